"""Strategies for teams without rovers: a rule assigns a frontier cell to each robot.

`FrontierRule` (rule.py) chooses cells from a `FrontierView`; `Bidders` is the base of rules by bids, `Covering`
(covering.py) a rule of its own. `FrontierStrategy` (exploration.py) runs a rule in a mission, and `OnArrival`
(arrival.py) decides when to ask it.
"""
