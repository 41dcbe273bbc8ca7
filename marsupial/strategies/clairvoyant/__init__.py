"""A plan by one who knows the map: how fast could this team have explored it?

The clairvoyant has the same robots, starts, sensors and docking times as any strategy, but sees the whole map before it
plans, and plans only once, at length. Its plan is carried out in the same simulated world; its exploration time is the
moment at which every reachable cell has been seen. The plan is the best one that a local search found: a practical
bound on what strategies can do, not a proven one.
"""

CLAIRVOYANT = "clairvoyant"
"""Its name; it is not in the registry of strategies, since it needs the truth."""

SEARCH = "anytime"
"""The planner whose search it uses."""
