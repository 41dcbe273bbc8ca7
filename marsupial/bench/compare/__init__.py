"""Comparisons of strategies and planners: paired missions over maps, team sizes and seeds.

plan       which missions: a `Trial` is a contender (strategy, planner) on a case (scenario, team) with a seed
conduct    runs the trials that are missing, each by `trial`, on this machine or a Ray cluster (`ray_pool`)
folder     stores each result at once as lines of CSV (`rows`) under a head, so a comparison can resume
cells      aggregates rows per case and contender: means and paired differences (`statistics`)
answer, tables, figures, pairs, statements    what is derived from them; `report` writes all documents
arguments  contenders and cases of what a caller names; `calling` is `marsupial.compare`
"""
