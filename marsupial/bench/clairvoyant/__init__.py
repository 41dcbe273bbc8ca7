"""A plan by somebody who knows the map: how fast could this team have explored it?

The clairvoyant has the same robots, starts, sensors and docking times as any strategy, but sees the whole map before it
plans, as long as it likes. Its plan is carried out in the same simulated world; its exploration time is the moment at
which all of the reachable area has been seen. It is the best plan found, not a proven optimum, so a strategy's time
divided by it is the competitive ratio or a little less.
"""

CLAIRVOYANT = "clairvoyant"
"""Its name among strategies; it is none, since it needs the truth."""

SEARCH = "anytime"
"""The planner whose search it uses."""
