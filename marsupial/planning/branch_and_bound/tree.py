"""What a search remembers between calls: a frame for each level of the tree, and what has been found."""

from __future__ import annotations

from typing import NamedTuple

from marsupial.arrays import Ints

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


class Search(NamedTuple):
    """What a search remembers between calls.

    Attributes
    ----------
    states
        (levels, robots, 3): see `tables`.
    levels
        (levels, 4): `LEFT` and so on.
    events
        (n, 7): those listed for all levels up to the current one; `END` and so on.
    path
        (levels, 7): the event that led to each level.
    best
        (levels, 7): the path of the best plan.
    shares
        (robots,): the sets that robots explore after it.
    parts, scratch
        See `cover`.
    jobs, loads
        See `shared`.
    tallies
        (8,): `LEVEL` and so on.
    memory, order
        See `remember`.
    """

    states: Ints
    levels: Ints
    events: Ints
    path: Ints
    best: Ints
    shares: Ints
    parts: Ints
    scratch: Ints
    tallies: Ints
    jobs: Ints
    loads: Ints
    memory: Ints
    order: Ints
