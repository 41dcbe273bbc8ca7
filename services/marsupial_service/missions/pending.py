"""News from reports, gathered until a mission gets it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from marsupial.model.frames import FrameShift
from marsupial.model.grid import UNKNOWN, CellArray
from marsupial.model.world import MomentNews, News
from marsupial_service.missions.reported import MapChange

Seen = tuple[str, npt.NDArray[np.int64]]  # a robot and cells, by row-major indices


@dataclass(slots=True)
class PendingNews(MomentNews):
    """News from reports, gathered until the mission gets it: at once, or at the end of a pause."""

    moved: FrameShift | None = None
    partial: bool = False

    def add(self, name: str, change: MapChange) -> None:
        """Add cells: revealed if they were unknown at the last news, changed if they were known then."""
        _, indices, before, codes = change
        new, other = (before == UNKNOWN) & (codes != UNKNOWN), (before != UNKNOWN) & (before != codes)
        if other.any():
            _add(name, indices[other], to=self.changed, unless_in=self.revealed)
        if new.any():
            _add(name, indices[new], to=self.revealed, unless_in=self.changed)

    def reindex(self, shift: FrameShift) -> None:
        """Re-index all cells after the frame has grown."""
        self.moved = shift if self.moved is None else self.moved.then(shift)
        self.revealed = [(name, shift.indices(cells)) for name, cells in self.revealed]
        self.changed = [(name, shift.indices(cells)) for name, cells in self.changed]

    def at(self, t_ms: int, codes: CellArray) -> News:
        """Return the news as of `t_ms`, when the cells (flat) have these codes."""
        known = [(name, cells[codes[cells] != UNKNOWN]) for name, cells in self.revealed]
        parts = self.parts() | {"revealed": tuple((name, cells) for name, cells in known if len(cells))}
        return News(t_ms=t_ms, moved=self.moved, partial=self.partial, **parts)


def _add(name: str, cells: npt.NDArray[np.int64], *, to: list[Seen], unless_in: Sequence[Seen]) -> None:
    if unless_in:
        cells = cells[~np.isin(cells, np.concatenate([seen for _, seen in unless_in]))]
    if len(cells):
        to.append((name, cells))
