"""The columns of the arrays of branch and bound, and how long they are."""

from __future__ import annotations

ROW, FROM, SHARE, MAY = 0, 1, 2, 3
"""Columns of parts: row of the book, when the robot is ready, the set it takes, the set it may take from."""

ERRAND, TAKES, TRIED = 0, 1, 2
"""Rows of a list of what is to be done: the number of its bit, ms, the carrier it is given to."""

TOURED, BUSY, ABOARD = 0, 1, 2
"""Rows of loads: the set of errands of each carrier, ms of docks and undocks, rovers aboard or free to be had."""

WHERE, ON, SINCE = 0, 1, 2
"""Columns of a state of robots: a base, or -1 aboard; the carrier, or -1; from when it is ready if it is not aboard."""

KIND, PLACES, DOCKS, UNDOCKS, TWIN = range(5)
"""Columns of traits: type, capacity, ms of docking and undocking, and the first robot that is like it."""

LEVELS = 60
"""How many docks and undocks there can be in a row; where more are needed nothing is proven."""

WIDTH = 1 << 17
"""How many events can wait at a time; where there are more nothing is proven."""

LEFT, KEY, FIRST, NEXT = 0, 1, 2, 3
"""Columns of levels: targets left, key of the last event, index of the first event that can follow and of the next."""

TIES = 64
"""A key is when an event ends, times this, and how many events before it end at the same ms."""

END, ROVER, CARRIER, AT, OWN, BROUGHT, DOWN = range(7)
"""Columns of events: key, robots, number of the meeting, sets explored by carrier and rover, whether an undock."""

LEVEL, NODES, LIMIT, FOUND, LOST, KEYED, SEEN, BOUND = range(8)
"""Tallies: the current level (-1: at the end), states entered, ms (with epsilon) that plans have to be shorter than,
1 + the length of `path` of the best plan (0: none), whether something was left out for lack of space, whether keys are
kept (not where nothing takes time), states met before, states without hope."""
