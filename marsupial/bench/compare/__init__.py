"""Comparisons of strategies and planners: paired missions over maps, team sizes and seeds.

`plan` says which missions, `runner` and `pool` carry them out, `folder` keeps their rows, `cells` and `statistics` make
figures of them, `tables`, `figures` and `report` show these.
"""
