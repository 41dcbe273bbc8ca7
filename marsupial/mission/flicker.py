"""What of a changing map flickers, and what is made of it: the map that plans are made from.

Maps that others make change: a door closes, a box is moved, a part is drawn anew. That is news. But some cells are lost
and found, or are ground and obstacle by turns, over and over, for no reason in the world: the frame of a door seen from
two sides, ground that a scan just misses. As news they would keep a team busy for ever. So changes are counted:

- Cells that have been lost often, and those close by, count as what they were when they were last known. To be lost
  still when a robot has stood beside counts as being lost once more.
- Cells that become something else again and again count as obstacles, until they have been the same for a while. Where
  a robot stands is ground all the same.

Everything else is as it is told, and an obstacle is one in any case as long as it is told.
"""

from __future__ import annotations

import numpy as np

from marsupial.arrays import Bytes, Flags, Ints
from marsupial.maps.reach import groups, middle
from marsupial.maps.targets import cell_at
from marsupial.model.frames import FrameShift
from marsupial.model.grid import OBSTACLE, UNKNOWN, CellArray
from marsupial.model.mission import Remaining

MOST_LOSSES = 2
"""How often a cell may be lost before it flickers: where the map is corrected that happens once or twice."""

NEAR_CELLS = 2
"""How close to a cell that flickers others do, too: what is drawn on a map shifts by a cell or two."""

MOST_FLIPS = 4
"""How often a cell may become something else before it flickers: a door that opens and closes twice does so often."""

STEADY_MS = 60_000
"""How long a cell has to be the same to count as what it is told; flips further apart than that are not added up."""


class Flicker:
    """Counts the changes of one map.

    Parameters
    ----------
    told
        The map (height, width) as it is told, live.
    last
        What was known of it before the first change.

    Attributes
    ----------
    cells
        The map (height, width) that plans are made from, live.
    """

    def __init__(self, told: CellArray, last: CellArray) -> None:
        self._told = told
        self.cells, self._last = last.copy(), last
        self._ground = np.where(last == OBSTACLE, np.uint8(UNKNOWN), last)
        self._losses, self._flips = np.zeros_like(told), np.zeros_like(told)
        self._lasting = np.zeros(told.shape, dtype=np.bool_)
        self._flipped_ms = np.zeros(told.shape, dtype=np.int64)
        self._watched: Ints = np.empty(0, dtype=np.int64)

    def move(self, shift: FrameShift, told: CellArray) -> None:
        """Take in that the frame has grown; `told` is the map in it."""
        self._told = told
        self.cells, self._last, self._ground = (
            shift.laid_out(cells, UNKNOWN) for cells in (self.cells, self._last, self._ground)
        )
        self._losses, self._flips = shift.laid_out(self._losses, 0), shift.laid_out(self._flips, 0)
        self._lasting, self._flipped_ms = shift.laid_out(self._lasting, 0), shift.laid_out(self._flipped_ms, 0)
        self._watched = shift.indices(self._watched)

    @property
    def any(self) -> bool:
        """Whether anything flickers, or did."""
        return bool(len(self._watched))

    def take_in(self, seen: Ints, now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Take in what is told now of cells (row-major indices, ascending, each once).

        Parameters
        ----------
        under
            Cells that robots stand on.

        Returns
        -------
        tuple
            The cells that are known now to who makes plans, and those known before that are something else now.
        """
        told, last = self._told.ravel()[seen], self._last.ravel()[seen]
        before = self.cells.ravel()[seen]
        known = told != UNKNOWN
        self._lose(seen[~known & (before != UNKNOWN)])
        self._flip(seen[known & (last != UNKNOWN) & (last != told)], now_ms)
        self._last.ravel()[seen[known]] = told[known]
        ground = known & (told != OBSTACLE)
        self._ground.ravel()[seen[ground]] = told[ground]
        return self._settle(np.union1d(seen, self._watched), now_ms, under)

    def looked_at(self, cells: Ints) -> None:
        """Take in that a robot has been beside cells: where they are lost all the same, that counts as being lost."""
        self._lose(cells[(self.cells.ravel()[cells] == UNKNOWN) & (self._last.ravel()[cells] != UNKNOWN)])

    def release(self, now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Let what counts as an obstacle, and is told to be none, be what it is told; return what `take_in` does."""
        held = self._held(self._watched, now_ms) & (self._told.ravel()[self._watched] != OBSTACLE)
        self._flips.ravel()[self._watched[held]] = 0
        return self._settle(self._watched, now_ms, under)

    def remaining(self, now_ms: int) -> tuple[Remaining, ...]:
        """Return what counts as something else than it is told to be, in groups of cells that touch."""
        lost = self._watched[self._told.ravel()[self._watched] == UNKNOWN]
        lost = lost[self.cells.ravel()[lost] != UNKNOWN]
        other = np.setdiff1d(self._watched[self._held(self._watched, now_ms)], lost)
        told = {
            "flickers: known and lost again and again, so it counts as what it was": lost,
            "flickers: ground and obstacle by turns, so it counts as an obstacle": other,
        }
        shape, width = self.cells.shape, self.cells.shape[1]
        return tuple(
            Remaining(cell=cell_at(int(middle(group, width)), width), frontier_cells=len(group), reason=reason)
            for reason, cells in told.items()
            for group in groups(cells, shape)
        )

    def _settle(self, cells: Ints, now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Let cells be what they count as now; return those that are known now, and those that have changed."""
        before, now = self.cells.ravel()[cells], self._counts_as(cells, now_ms, under)
        self.cells.ravel()[cells] = now
        known = before != UNKNOWN
        return cells[~known & (now != UNKNOWN)], cells[known & (before != now)]

    def _counts_as(self, cells: Ints, now_ms: int, under: Ints) -> Bytes:
        """Return the codes of cells (n,) for who makes plans."""
        told, lasting = self._told.ravel()[cells], self._lasting.ravel()[cells]
        codes = np.where((told == UNKNOWN) & lasting, self._last.ravel()[cells], told)
        held = self._held(cells, now_ms)
        ground = self._ground.ravel()[cells]
        stands = np.isin(cells, under) & (ground != UNKNOWN)
        return np.where(held, np.where(stands, ground, np.uint8(OBSTACLE)), codes)

    def _held(self, cells: Ints, now_ms: int) -> Flags:
        """Say which cells (n,) have become something else too often not long ago."""
        often = self._flips.ravel()[cells] > MOST_FLIPS
        return np.asarray(often & (now_ms - self._flipped_ms.ravel()[cells] <= STEADY_MS))

    def _lose(self, cells: Ints) -> None:
        """Count that cells are lost."""
        losses = self._losses.ravel()
        losses[cells] = np.minimum(losses[cells], MOST_LOSSES) + 1
        often = cells[losses[cells] > MOST_LOSSES]
        height, width = self.cells.shape
        span = np.arange(-NEAR_CELLS, NEAR_CELLS + 1)
        y = np.clip(often[:, None] // width + np.repeat(span, len(span)), 0, height - 1)
        x = np.clip(often[:, None] % width + np.tile(span, len(span)), 0, width - 1)
        self._lasting[y, x] = True
        self._watch((y * width + x).ravel())

    def _flip(self, cells: Ints, now_ms: int) -> None:
        """Count that cells become something else."""
        flips, flipped_ms = self._flips.ravel(), self._flipped_ms.ravel()
        recent = now_ms - flipped_ms[cells] <= STEADY_MS
        flips[cells] = np.where(recent, np.minimum(flips[cells], MOST_FLIPS) + 1, 1)
        flipped_ms[cells] = now_ms
        self._watch(cells[flips[cells] > MOST_FLIPS])

    def _watch(self, cells: Ints) -> None:
        if len(cells):
            self._watched = np.union1d(self._watched, cells)
