"""The clairvoyant: a plan made with the true map, as a practical bound on exploration time.

It has the same robots, starts, sensors and docking times as any strategy, but knows the true map, and plans only once,
with a large budget. Its plan is executed in the same simulator; its exploration time is when every reachable cell has
been seen. The plan is the best one that a local search found, so the bound is not proven.
"""

CLAIRVOYANT = "clairvoyant"
"""Its name; it is not in the registry of strategies, since it needs the true map."""
