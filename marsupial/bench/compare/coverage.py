"""Coverage over time, sampled at fixed moments of simulated time while a mission goes on."""

from __future__ import annotations

import numpy as np

from marsupial.bench.compare.rows import COVERAGE_SCALE
from marsupial.mission.observer import Observer
from marsupial.model.grid import Mask
from marsupial.model.mission import MissionEnded, MissionEvent, Revealed

EVERY_MS = 5_000
"""Simulated time between two samples."""


class CoverageSampler(Observer):
    """Notes the known share of what there is to explore every `EVERY_MS`, in parts of `COVERAGE_SCALE`.

    A sample holds what happened up to its moment; the last one is the mission's end.
    """

    def __init__(self) -> None:
        self.known: list[int] = []
        self._upto: list[int] = []
        self._area = 1
        self._cells = 0

    def reachable(self, area: Mask) -> None:
        """Take in what there is to explore."""
        self._upto = np.concatenate([[0], np.cumsum(area.ravel())]).tolist()
        self._area = max(1, self._upto[-1])

    def event(self, event: MissionEvent) -> None:
        """Take in what happened."""
        if isinstance(event, Revealed):
            self._catch_up(event.t_ms)
            for i in range(0, len(event.runs), 3):
                start, length = event.runs[i], event.runs[i + 1]
                self._cells += self._upto[start + length] - self._upto[start]
        elif isinstance(event, MissionEnded):
            self._catch_up(event.t_ms)
            self._note()

    def _catch_up(self, t_ms: int) -> None:
        while len(self.known) * EVERY_MS < t_ms:
            self._note()

    def _note(self) -> None:
        self.known.append(round(COVERAGE_SCALE * self._cells / self._area))
