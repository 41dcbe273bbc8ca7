"""Travel times between places, by the route lengths between their cells.

A place is a name with a cell per robot type that can use it. Types with the same routes share a search.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from marsupial.arrays import Floats
from marsupial.maps.territory import Territory
from marsupial.model import UNREACHABLE, RobotType, Routes, TravelTable
from marsupial.model.feed import Feed
from marsupial.model.grid import Cell, code_table
from marsupial.paths.fields import PathSearch, SearchMemory
from marsupial.paths.routes import travel_table_ms
from marsupial.paths.ways import Ways, ways_of

Poses = Mapping[str, Mapping[str, Cell]]  # the cell of each place, per robot type that can use it


def travel_times(
    kinds: Sequence[RobotType],
    poses: Poses,
    lengths_between: Callable[[Sequence[Cell], Sequence[int | None]], Floats],
    resolution_m: float,
    headings: Mapping[str, int | None] | None = None,
) -> dict[str, TravelTable]:
    """Return the travel times (ms) between places of robot types that share their routes, from one search.

    `lengths_between` returns the lengths (k, k) in cells between k cells, given the headings of robots that stand
    there; `headings` has the headings by place.
    """
    names = list(poses)
    # the cells where some type stands, with the headings there, numbered
    numbers: dict[tuple[Cell, int | None], int] = {}
    rows, ends = {}, {}
    for kind in kinds:
        rows[kind.name] = [i for i, name in enumerate(names) if kind.name in poses[name]]
        there = [(poses[names[i]][kind.name], (headings or {}).get(names[i])) for i in rows[kind.name]]
        ends[kind.name] = [numbers.setdefault(end, len(numbers)) for end in there]
    lengths = lengths_between([cell for cell, _ in numbers], [heading for _, heading in numbers])
    tables = {}
    for kind in kinds:
        at, row = ends[kind.name], rows[kind.name]
        table = tables[kind.name] = np.full((len(names), len(names)), UNREACHABLE, dtype=np.int64)
        table[np.ix_(row, row)] = travel_table_ms(lengths[np.ix_(at, at)], resolution_m, kind.speed_mps)
    return tables


def ways_by_type(territory: Territory, memory: SearchMemory) -> dict[str, Ways]:
    """Return the route search of each robot type, shared by types whose shortest routes are the same."""
    found: dict[str, Ways] = {}
    shared: dict[tuple[int, float], Ways] = {}
    for name, kind in territory.kinds.items():
        footprint = territory.footprints[name]
        own = ways_of(kind, footprint.standable, territory.grid.resolution_m, footprint.opened, memory)
        if kind.routes is Routes.SHORTEST:
            own = shared.setdefault((id(footprint), kind.diagonal), own)
        found[name] = own
    return found


class AllGround:
    """The known ground that any robot type can drive on."""

    def __init__(self, territory: Territory, memory: SearchMemory) -> None:
        self._codes = territory.grid.cells
        self._drivable = code_table(frozenset[int]().union(*(kind.terrains for kind in territory.kinds.values())))
        self._revealed, self._opened = territory.revealed.reader(), Feed()
        self._search = PathSearch(self._drivable[self._codes], opened=self._opened, memory=memory)

    def search(self) -> PathSearch:
        """Return a search on the present ground."""
        revealed = self._revealed.cells()
        opened = revealed[self._drivable[self._codes.ravel()[revealed]]]
        self._search.passable.ravel()[opened] = True
        self._opened.add(opened)
        return self._search
