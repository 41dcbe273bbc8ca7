"""What a search remembers between calls: a frame for each level of the tree, and what has been found."""

from __future__ import annotations

from typing import NamedTuple

from marsupial.arrays import Ints


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
