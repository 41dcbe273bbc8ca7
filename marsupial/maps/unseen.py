"""The unseen part of a map, in squares about as large as a room.

A square counts as unseen while at least half of it is unknown. The map ends where its grid does; cells that stay
unknown for ever, such as the inside of rock, can't be distinguished from unseen cells.
"""

from collections.abc import Sequence

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.footprint import known_parts
from marsupial.maps.targets import Target
from marsupial.maps.territory import Reach, Territory
from marsupial.model import UNKNOWN, Cell, Mask, Role, Square, Unseen

SIDE_M = 8.0  # length of the side of a square
UNKNOWN_SHARE = 0.5  # share of a square that must be unknown

FIRST_GUESS, FIRST_GUESS_M2 = 0.3, 25.0
"""Expected share of rover-only ground before any is seen, and its weight as an area of seen ground."""

CODES = 256  # number of possible terrain codes


class UnseenPart:
    """The unseen part of a growing territory, updated with the cells revealed since the last call."""

    def __init__(self, territory: Territory) -> None:
        self._territory = territory
        self._revealed = territory.revealed.reader()
        grid = territory.grid
        self._side = max(1, round(SIDE_M / grid.resolution_m))
        (rows, of_y), (columns, of_x) = (_ranges(cells, self._side) for cells in (grid.height, grid.width))
        self._unknown = np.outer(rows, columns)
        self._sum_x, self._sum_y = np.outer(rows, of_x), np.outer(of_y, columns)
        self._known_by_code = np.zeros(CODES, dtype=np.int64)
        zoning = grid.zoning
        self._weights = None if zoning is None else zoning.weights
        self._inside = None if zoning is None or zoning.inside is None else zoning.inside.ravel()
        if self._inside is not None:  # what lies outside counts as seen
            self._leave_out(np.flatnonzero(~self._inside))
        for cells in known_parts(grid):
            self._reveal(cells)

    def now(self, targets: Sequence[Target], reach: Reach) -> Unseen:
        """Return what is unseen now, with the positions of the targets."""
        self._reveal(self._revealed.cells())
        resolution = self._territory.grid.resolution_m
        return Unseen(
            squares=self._squares(),
            at_m={target.name: (target.cell.x * resolution, target.cell.y * resolution) for target in targets},
            rovers_only=self._rovers_only(reach),
            shared=self._shared(),
            speed_mps={kind.name: kind.speed_mps for kind in self._territory.kinds.values()},
            side=self._side,
        )

    def _reveal(self, cells: Ints) -> None:
        self._known_by_code += np.bincount(self._territory.grid.cells.ravel()[cells], minlength=CODES)
        self._leave_out(cells if self._inside is None else cells[self._inside[cells]])

    def _leave_out(self, cells: Ints) -> None:
        """Remove cells from the unknown ones of their squares."""
        y, x = np.divmod(cells, self._territory.grid.width)
        of_square = y // self._side, x // self._side
        for sums, values in ((self._unknown, 1), (self._sum_x, x % self._side), (self._sum_y, y % self._side)):
            np.subtract.at(sums, of_square, values)

    def _squares(self) -> tuple[Square, ...]:
        side, metres = self._side, self._territory.grid.resolution_m
        left = np.argwhere(self._unknown >= UNKNOWN_SHARE * side**2)
        count = self._unknown[left[:, 0], left[:, 1]]
        x, y = (sums[left[:, 0], left[:, 1]] / count for sums in (self._sum_x, self._sum_y))
        return tuple(
            Square(
                name=f"{column}_{row}",
                x_m=(column * side + float(x[i])) * metres,
                y_m=(row * side + float(y[i])) * metres,
                share=unknown / side**2,
                draw=(37 * column + 61 * row) % 100 / 100,
                priority=self._priority(row, column),
                at=Cell(column, row),
            )
            for i, ((row, column), unknown) in enumerate(zip(left.tolist(), count.tolist(), strict=True))
        )

    def _priority(self, row: int, column: int) -> float:
        """Return how much more a square is worth than others: the mean over its unknown cells that are explored."""
        if self._weights is None:
            return 1.0
        cut = np.s_[row * self._side : (row + 1) * self._side, column * self._side : (column + 1) * self._side]
        unknown = self._territory.grid.cells[cut] == UNKNOWN
        if self._inside is not None:
            unknown &= self._inside.reshape(self._weights.shape)[cut]
        return float(self._weights[cut][unknown].mean())

    def _rovers_only(self, reach: Reach) -> float:
        rovers, carriers = self._terrains(Role.ROVER), self._terrains(Role.CARRIER)
        only = self._known(rovers - carriers) + self._territory.grid.cell_area_m2 * self._behind_narrow_doors(reach)
        return (only + FIRST_GUESS * FIRST_GUESS_M2) / (self._known(rovers | carriers) + FIRST_GUESS_M2)

    def _behind_narrow_doors(self, reach: Reach) -> int:
        """Return how many cells rovers reach where a carrier would fit but has no path."""
        cut = self._territory.known.cut
        carriers, rovers = self._territory.of_role(Role.CARRIER), self._territory.of_role(Role.ROVER)
        prints = self._territory.footprints
        nowhere: Mask = np.zeros_like(self._territory.see_through[cut])
        room = np.logical_or.reduce([nowhere, *(prints[kind.name].standable[cut] for kind in carriers)])
        by_carriers, by_rovers = (
            np.logical_or.reduce([nowhere, *(reach.by_type[kind.name][cut] for kind in kinds)])
            for kinds in (carriers, rovers)
        )
        return int(np.count_nonzero(room & ~by_carriers & by_rovers))

    def _shared(self) -> float:
        rovers, carriers = self._terrains(Role.ROVER), self._terrains(Role.CARRIER)
        ground = self._known(carriers)
        return self._known(carriers & rovers) / ground if ground else float(bool(carriers & rovers))

    def _terrains(self, role: Role) -> frozenset[int]:
        return frozenset[int]().union(*(kind.terrains for kind in self._territory.of_role(role)))

    def _known(self, codes: frozenset[int]) -> float:
        """Return the known area of these terrains in m2."""
        return float(self._known_by_code[sorted(codes)].sum()) * self._territory.grid.cell_area_m2


def _ranges(cells: int, side: int) -> tuple[Ints, Ints]:
    """Split `cells` cells into ranges of `side`; return the size of each, and the sum of the positions in it."""
    counts = np.full(-(-cells // side), side, dtype=np.int64)
    counts[-1] -= len(counts) * side - cells
    return counts, counts * (counts - 1) // 2
