"""The arrays of branch and bound: their columns, how long they are, and the state of a search."""

from typing import NamedTuple

from marsupial.arrays import Ints

ROW, READY, SHARE, ALLOWED = 0, 1, 2, 3
"""Columns of assignments: row of `solo_times`, when the robot is ready, its targets, those it may choose from."""

ERRAND, TAKES, TRIED = 0, 1, 2  # rows of jobs: the bit of the errand, its ms, the carrier that it is assigned to

TOURED, BUSY, ABOARD = 0, 1, 2
"""Rows of loads: the set of errands of each carrier, ms of its docks and undocks, rovers aboard or available."""

WHERE, ON, SINCE = 0, 1, 2
"""Columns of a state, per robot: base, or -1 aboard; carrier, or -1; ready since, if it is not aboard."""

KIND, PLACES, DOCKS, UNDOCKS, TWIN, SEATS = range(6)
"""Columns of traits: type, capacity, ms of docking and undocking, the first robot that it is interchangeable with, and
`ProblemData.seats` per type."""

MOST_LEVELS = 60  # most docks and undocks of a plan; if more are needed, nothing is proven
MOST_EVENTS = 1 << 17  # most events waiting at a time; if there are more, nothing is proven

# columns of levels: targets left, key of the last event, index of the first event listed and of the next to try
LEFT, KEY, FIRST, NEXT = range(4)

KEY_SCALE = 64  # a key is the end of an event times this, plus the number of events before it that end at the same ms

END, ROVER, CARRIER, AT, OWN, BROUGHT, DOWN = range(7)
"""Columns of events: key, robots, number of the meeting, sets explored by carrier and rover, whether an undock."""

LEVEL, NODES, LIMIT, FOUND, INCOMPLETE, KEYED, DUPLICATES, PRUNED = range(8)
"""Counters: current level (-1: at the end), states entered, limit in ms (with epsilon) that plans have to be below, 1 +
the length of the best plan's `path` (0: none), whether something was left out for lack of space, whether keys are used
(not where nothing takes time), states dominated, states pruned by bounds."""


class SearchState(NamedTuple):
    """The state of a search between calls; the docstring of `search` relates levels and events."""

    states: Ints  # (levels, robots, 3): `WHERE` and so on
    levels: Ints  # (levels, 4): `LEFT` and so on
    events: Ints  # (n, 7): the events listed for all levels up to the current one; `END` and so on
    path: Ints  # (levels, 7): the event that led to each level
    best: Ints  # (levels, 7): the path of the best plan
    shares: Ints  # (robots,): the sets that robots explore after the last event of `best`
    # assignments, scratch: see `cover`
    assignments: Ints
    scratch: Ints
    counters: Ints  # (8,): `LEVEL` and so on
    # jobs, loads: see `can_share`
    jobs: Ints
    loads: Ints
    # memory, order: see `is_dominated`
    memory: Ints
    order: Ints
