"""Travel times between places, by the route lengths between their cells.

A place is a name with a cell per robot type that can use it. Types with the same routes share a search.
"""

from __future__ import annotations

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

LengthsBetween = Callable[[Sequence[Cell], Sequence[int | None]], Floats]
"""Returns the lengths (k, k) in cells between k cells, given the headings there."""


def travel_times(
    kind: RobotType,
    names: Sequence[str],
    poses: Poses,
    lengths_between: LengthsBetween,
    resolution_m: float,
    headings: Mapping[str, int | None] | None = None,
) -> TravelTable:
    """Return the travel times (ms) of a robot type between places; `headings` are those of robots that stand there."""
    rows = [i for i, name in enumerate(names) if kind.name in poses[name]]
    table = np.full((len(names), len(names)), UNREACHABLE, dtype=np.int64)
    if rows:
        cells = [poses[names[i]][kind.name] for i in rows]
        lengths = lengths_between(cells, [(headings or {}).get(names[i]) for i in rows])
        table[np.ix_(rows, rows)] = travel_table_ms(lengths, resolution_m, kind.speed_mps)
    return table


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


def shared_lengths(ways: Ways, kinds: Sequence[RobotType], names: Sequence[str], poses: Poses) -> LengthsBetween:
    """Return the lengths between cells of robot types that share their routes, from one search."""
    cells = dict.fromkeys(poses[name][kind.name] for kind in kinds for name in names if kind.name in poses[name])
    number, table = {cell: i for i, cell in enumerate(cells)}, ways.matrix(list(cells))

    def between(cells: Sequence[Cell], _headings: Sequence[int | None]) -> Floats:
        at = [number[cell] for cell in cells]
        return table[np.ix_(at, at)]

    return between


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
