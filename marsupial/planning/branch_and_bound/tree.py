"""The state of a search: one frame per level of the tree, and the best plan found."""

from __future__ import annotations

from typing import NamedTuple

from marsupial.arrays import Ints


class SearchState(NamedTuple):
    """All that a search keeps between calls; `search` draws how levels and events belong together."""

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
