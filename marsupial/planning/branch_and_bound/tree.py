"""The state of a search: one frame per level of the tree, and the best plan found."""

from __future__ import annotations

from typing import NamedTuple

from marsupial.arrays import Ints


class SearchState(NamedTuple):
    """All that a search keeps between calls; `search` draws how levels and events belong together.

    Attributes
    ----------
    states
        (levels, robots, 3): `WHERE` and so on.
    levels
        (levels, 4): `LEFT` and so on.
    events
        (n, 7): the events listed for all levels up to the current one; `END` and so on.
    path
        (levels, 7): the event that led to each level.
    best
        (levels, 7): the path of the best plan.
    shares
        (robots,): the sets that robots explore after the last event of `best`.
    assignments, scratch
        See `cover`.
    jobs, loads
        See `can_share`.
    counters
        (8,): `LEVEL` and so on.
    memory, order
        See `is_dominated`.
    """

    states: Ints
    levels: Ints
    events: Ints
    path: Ints
    best: Ints
    shares: Ints
    assignments: Ints
    scratch: Ints
    counters: Ints
    jobs: Ints
    loads: Ints
    memory: Ints
    order: Ints
