"""Filters flickering cells out of a map that other software builds; plans are made from the filtered map.

Known cells of such a map change for good reasons: a door closes, a box is moved. But some cells flicker without a cause
in the world, such as a door frame seen from two sides: they alternate between unknown and known, or between ground and
obstacle. Such changes would trigger replanning for ever. So `Flicker` counts the changes of each cell:

- A cell that became unknown often, and the cells near it, keep their last known value while they are unknown. A cell
  that is still unknown after a robot was beside it counts as lost once more.
- A cell that changed its value often counts as an obstacle until it has been the same for a while; under a robot it
  counts as ground.

An unknown cell that rests or is given up (`vain`) counts as an obstacle. All other cells have the value that is
reported, and a reported obstacle always counts as an obstacle.
"""

from collections.abc import Mapping

import numpy as np

from marsupial.arrays import Bytes, Flags, Ints
from marsupial.maps.reach import groups, middle
from marsupial.maps.targets import cell_at
from marsupial.model import OBSTACLE, UNKNOWN, CellArray, FrameShift, Remaining

MOST_LOSSES = 2  # how often a cell may become unknown before it flickers: a correction of the map does that twice

NEAR_CELLS = 2  # cells this close to a flickering one flicker too: what is drawn on a map shifts by a cell or two

MOST_FLIPS = 4  # how often a cell may change before it flickers: a door that opens and closes twice changes 4 times

STEADY_MS = 60_000  # how long a flickering cell has to be the same to count as reported; older flips do not count


class Flicker:
    """Counts the changes of the map `raw`, live as it is reported, and filters it; `last` is the map before."""

    def __init__(self, raw: CellArray, last: CellArray) -> None:
        self._raw = raw
        self.cells, self._last = last.copy(), last  # the filtered map, live; last known value of each cell
        self._ground = np.where(last == OBSTACLE, np.uint8(UNKNOWN), last)  # last value other than obstacle
        self._losses, self._flips = np.zeros_like(raw), np.zeros_like(raw)  # how often unknown, how often changed
        self._kept = np.zeros(raw.shape, dtype=np.bool_)  # cells that keep their last value while unknown
        self._flipped_ms = np.zeros(raw.shape, dtype=np.int64)
        self._watched: Ints = np.empty(0, dtype=np.int64)  # row-major indices of cells that flicker or did
        self._given_up: Mapping[str, Ints] = {}  # row-major indices by reason

    def move(self, shift: FrameShift, raw: CellArray) -> None:
        """Re-index all cells after the frame grew; `raw` is the reported map in the new frame."""
        self._raw = raw
        self.cells, self._last, self._ground = (
            shift.laid_out(cells, UNKNOWN) for cells in (self.cells, self._last, self._ground)
        )
        self._losses, self._flips = shift.laid_out(self._losses, 0), shift.laid_out(self._flips, 0)
        self._kept, self._flipped_ms = shift.laid_out(self._kept, 0), shift.laid_out(self._flipped_ms, 0)
        self._watched = shift.indices(self._watched)
        self._given_up = {reason: shift.indices(cells) for reason, cells in self._given_up.items()}

    @property
    def any(self) -> bool:
        """Whether anything flickers or is given up, or did or was."""
        return bool(len(self._watched))

    def update(self, seen: Ints, now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Count changes of reported cells (row-major, ascending, each once); robots stand on those `under` them.

        Return the cells that became known in the filtered map, and the known cells that changed in it.
        """
        raw, last = self._raw.ravel()[seen], self._last.ravel()[seen]
        before = self.cells.ravel()[seen]
        known = raw != UNKNOWN
        self._count_losses(seen[~known & (before != UNKNOWN)])
        self._count_flips(seen[known & (last != UNKNOWN) & (last != raw)], now_ms)
        self._last.ravel()[seen[known]] = raw[known]
        ground = known & (raw != OBSTACLE)
        self._ground.ravel()[seen[ground]] = raw[ground]
        # watched cells can change without a report: a robot moves on, or the settling time ends
        return self._filter(np.union1d(seen, self._watched), now_ms, under)

    def visited(self, cells: Ints) -> None:
        """Count cells that are still unknown although a robot was beside them as lost once more."""
        self._count_losses(cells[(self.cells.ravel()[cells] == UNKNOWN) & (self._last.ravel()[cells] != UNKNOWN)])

    def release(self, now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Reset cells that count as obstacles but are reported as ground; return the same as `update`."""
        held = self._held(self._watched, now_ms) & (self._raw.ravel()[self._watched] != OBSTACLE)
        self._flips.ravel()[self._watched[held]] = 0
        return self._filter(self._watched, now_ms, under)

    def give_up(self, cells: Mapping[str, Ints], now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Give up these cells, by reason, and no others; return the same as `update`."""
        before = self._all_given_up
        self._given_up = cells
        self._watch(self._all_given_up)
        return self._filter(np.union1d(before, self._all_given_up), now_ms, under)

    def remaining(self, now_ms: int) -> tuple[Remaining, ...]:
        """Return the cells whose filtered value differs from the reported one, in connected groups."""
        lost = self._watched[self._raw.ravel()[self._watched] == UNKNOWN]
        lost = np.setdiff1d(lost[self.cells.ravel()[lost] != UNKNOWN], self._all_given_up)
        other = np.setdiff1d(self._watched[self._held(self._watched, now_ms)], lost)
        groups_by_reason = {
            **{reason: self._ground_beside(cells) for reason, cells in self._given_up.items()},
            "flickers between known and unknown, so it counts as what it was": lost,
            "flickers between ground and obstacle, so it counts as an obstacle": other,
        }
        shape, width = self.cells.shape, self.cells.shape[1]
        return tuple(
            Remaining(cell=cell_at(int(middle(group, width)), width), frontier_cells=len(group), reason=reason)
            for reason, cells in groups_by_reason.items()
            for group in groups(cells, shape)
        )

    @property
    def _all_given_up(self) -> Ints:
        return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *self._given_up.values()]))

    def _ground_beside(self, cells: Ints) -> Ints:
        """Return the cells that are frontier cells if these ones count as unknown: stop reports name those."""
        height, width = self.cells.shape
        y, x = np.divmod(cells[:, None], width)
        v, u = y + np.array([0, 0, 1, -1]), x + np.array([1, -1, 0, 0])
        inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
        beside = np.unique((v * width + u)[inside])
        found = beside[np.isin(self._raw.ravel()[beside], (UNKNOWN, OBSTACLE), invert=True)]
        return found if len(found) else cells

    def _filter(self, cells: Ints, now_ms: int, under: Ints) -> tuple[Ints, Ints]:
        """Update cells of the filtered map; return those that became known, and known ones that changed."""
        before, now = self.cells.ravel()[cells], self._filtered(cells, now_ms, under)
        self.cells.ravel()[cells] = now
        known = before != UNKNOWN
        return cells[~known & (now != UNKNOWN)], cells[known & (before != now)]

    def _filtered(self, cells: Ints, now_ms: int, under: Ints) -> Bytes:
        raw, kept = self._raw.ravel()[cells], self._kept.ravel()[cells]
        codes = np.where((raw == UNKNOWN) & kept, self._last.ravel()[cells], raw)
        held = self._held(cells, now_ms) | ((codes == UNKNOWN) & np.isin(cells, self._all_given_up))
        ground = self._ground.ravel()[cells]
        stands = np.isin(cells, under) & (ground != UNKNOWN)
        return np.where(held, np.where(stands, ground, np.uint8(OBSTACLE)), codes)

    def _held(self, cells: Ints, now_ms: int) -> Flags:
        """Return which cells (n,) have changed too often recently."""
        often = self._flips.ravel()[cells] > MOST_FLIPS
        return np.asarray(often & (now_ms - self._flipped_ms.ravel()[cells] <= STEADY_MS))

    def _count_losses(self, cells: Ints) -> None:
        losses = self._losses.ravel()
        losses[cells] = np.minimum(losses[cells], MOST_LOSSES) + 1
        often = cells[losses[cells] > MOST_LOSSES]
        height, width = self.cells.shape
        span = np.arange(-NEAR_CELLS, NEAR_CELLS + 1)
        y = np.clip(often[:, None] // width + np.repeat(span, len(span)), 0, height - 1)
        x = np.clip(often[:, None] % width + np.tile(span, len(span)), 0, width - 1)
        self._kept[y, x] = True
        self._watch((y * width + x).ravel())

    def _count_flips(self, cells: Ints, now_ms: int) -> None:
        flips, flipped_ms = self._flips.ravel(), self._flipped_ms.ravel()
        recent = now_ms - flipped_ms[cells] <= STEADY_MS
        flips[cells] = np.where(recent, np.minimum(flips[cells], MOST_FLIPS) + 1, 1)
        flipped_ms[cells] = now_ms
        self._watch(cells[flips[cells] > MOST_FLIPS])

    def _watch(self, cells: Ints) -> None:
        if len(cells):
            self._watched = np.union1d(self._watched, cells)
