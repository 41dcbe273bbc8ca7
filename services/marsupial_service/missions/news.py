"""What reports say, gathered until it is news to the mission: at once, or at the end of a pause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from marsupial.model.frames import FrameShift
from marsupial.model.grid import UNKNOWN, CellArray
from marsupial.model.world import News

Seen = tuple[str, npt.NDArray[np.int64]]
"""A robot and cells, by row-major indices."""


@dataclass(slots=True)
class PendingNews:
    """News in the making."""

    revealed: list[Seen] = field(default_factory=list)
    changed: list[Seen] = field(default_factory=list)
    moved: FrameShift | None = None
    partial: bool = False
    finished: list[str] = field(default_factory=list)
    failed: list[tuple[str, str]] = field(default_factory=list)
    lost: list[tuple[str, str]] = field(default_factory=list)

    def see(
        self, name: str, indices: npt.NDArray[np.int64], before: npt.NDArray[np.uint8], codes: npt.NDArray[np.uint8]
    ) -> None:
        """Take in cells and their codes before and now.

        Revealed are those that were unknown at the last news, changed those that were known then.
        """
        new, other = (before == UNKNOWN) & (codes != UNKNOWN), (before != UNKNOWN) & (before != codes)
        if other.any():
            cells = _without(indices[other], self.revealed)
            self.changed += [(name, cells)] if len(cells) else []
        if new.any():
            cells = _without(indices[new], self.changed)
            self.revealed += [(name, cells)] if len(cells) else []

    def move(self, shift: FrameShift) -> None:
        """Call all cells as they are called now that the frame has grown."""
        self.moved = shift if self.moved is None else self.moved.then(shift)
        self.revealed = [(name, shift.indices(cells)) for name, cells in self.revealed]
        self.changed = [(name, shift.indices(cells)) for name, cells in self.changed]

    def at(self, t_ms: int, codes: CellArray) -> News:
        """Return the news of a moment at which the cells (flat) have these codes."""
        known = [(name, cells[codes[cells] != UNKNOWN]) for name, cells in self.revealed]
        return News(
            t_ms=t_ms,
            revealed=tuple((name, cells) for name, cells in known if len(cells)),
            changed=tuple(self.changed),
            moved=self.moved,
            partial=self.partial,
            finished=tuple(self.finished),
            failed=tuple(self.failed),
            lost=tuple(self.lost),
        )


def _without(cells: npt.NDArray[np.int64], told: Sequence[Seen]) -> npt.NDArray[np.int64]:
    """Return the cells that are not among those that were told of before."""
    return cells[~np.isin(cells, np.concatenate([seen for _, seen in told]))] if told else cells
