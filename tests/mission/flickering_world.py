"""A simulated world whose map flickers: known cells repeatedly change their codes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import UNKNOWN, Cell, Grid, News, PlacedRobot, RobotType
from marsupial.sim.sensors import Sensor
from marsupial.sim.world import SimulatedWorld

REPORT_MS = 1000
"""The longest time between two reports."""

Blinks = Callable[["FlickeringWorld", int], Mapping[Cell, int]]
"""Returns, for a report number, the false codes of cells."""


class FlickeringWorld(SimulatedWorld):
    """Reports for known cells the codes from `blinks`, and the true codes once `blinks` has none for them.

    With `forgets`, cells reported as unknown stay unknown until a robot sees them again.
    """

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        blinks: Blinks,
        *,
        forgets: bool = False,
        sensor: Sensor | None = None,
    ) -> None:
        super().__init__(truth, kinds, robots, sensor=sensor)
        self._blinks = blinks
        self._forgets = forgets
        self._reports = 0
        self._said: dict[int, int] = {}

    def advance(self, until_ms: int) -> News:
        news = super().advance(min(until_ms, (self.now_ms // REPORT_MS + 1) * REPORT_MS))
        due = self.now_ms // REPORT_MS
        if due == self._reports:
            return news
        self._reports = due
        return self._blink(news, {c.y * self.grid.width + c.x: code for c, code in self._blinks(self, due).items()})

    def _blink(self, news: News, said: dict[int, int]) -> News:
        known, truth = self._motion.known.reshape(-1), self._motion.truth.cells.ravel()
        before = known.copy()
        for index in self._said.keys() - said.keys():
            if not self._forgets or self._said[index] != UNKNOWN:
                known[index] = truth[index]
        self._said = {index: code for index, code in said.items() if before[index] != UNKNOWN or index in self._said}
        for index, code in self._said.items():
            known[index] = code
        if self._forgets and any(code == UNKNOWN for code in self._said.values()):
            self._sensing.forget()
        first = next(iter(self._motion.team))
        new, seen = np.flatnonzero((before == UNKNOWN) & (known != UNKNOWN)), [i for _, i in news.revealed]
        changed = np.setdiff1d(np.flatnonzero((before != UNKNOWN) & (before != known)), _joined(seen))
        revealed = tuple((name, cells[known[cells] != UNKNOWN]) for name, cells in news.revealed)
        return replace(
            news,
            revealed=tuple(one for one in (*revealed, (first, new)) if len(one[1])),
            changed=((first, changed),) if len(changed) else (),
        )


def _joined(parts: Sequence[Ints]) -> Ints:
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])
