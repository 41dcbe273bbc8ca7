"""A simulated world some of whose cells no sensor shows, and whose map may come late."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.model import UNKNOWN, Cell, Grid, News, PlacedRobot, RobotType
from marsupial.sim.world import SimulatedWorld


class GlassWorld(SimulatedWorld):
    """Reveals neither the `glass` cells, nor anything before `late_ms` have passed since robots saw it.

    `opening` are cells that have another code from some time on: (ms, cell, code).
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        glass: Iterable[Cell],
        *,
        late_ms: int = 0,
        opening: Sequence[tuple[int, Cell, int]] = (),
    ) -> None:
        super().__init__(truth, kinds, robots)
        self._glass = np.array([cell.y * truth.width + cell.x for cell in glass], dtype=np.int64)
        self._late_ms = late_ms
        self._coming: dict[int, tuple[int, str]] = {}  # cells seen: when they are shown, and by whom
        self._opening = sorted(opening)

    def advance(self, until_ms: int) -> News:
        times = [due_ms for due_ms, _ in self._coming.values()] + [at_ms for at_ms, _, _ in self._opening]
        news = super().advance(min([until_ms, *(max(self.now_ms, due_ms) for due_ms in times)]))
        known, truth = self._motion.known.reshape(-1), self._motion.truth.cells.ravel()
        for name, cells in news.revealed:
            shown = np.setdiff1d(cells, self._glass)
            for cell in shown.tolist():
                self._coming.setdefault(cell, (self.now_ms + self._late_ms, name))
            known[cells] = UNKNOWN
        due = {cell: name for cell, (due_ms, name) in self._coming.items() if due_ms <= self.now_ms}
        self._coming = {cell: one for cell, one in self._coming.items() if cell not in due}
        known[list(due)] = truth[list(due)]
        revealed = tuple(
            (name, np.array(sorted(cell for cell, by in due.items() if by == name), dtype=np.int64))
            for name in dict.fromkeys(due.values())
        )
        changed = []
        while self._opening and self._opening[0][0] <= self.now_ms:
            _, (x, y), code = self._opening.pop(0)
            known[y * self.grid.width + x] = code
            changed.append(y * self.grid.width + x)
        first = next(iter(self._motion.team))
        return replace(news, revealed=revealed, changed=((first, np.array(sorted(changed))),) if changed else ())
