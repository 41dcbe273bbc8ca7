"""What a mission reports to those who watch: every event, and how each planning went.

The loop reports, the rim prints: logs, progress displays and statistics are observers.
"""

from __future__ import annotations

from collections.abc import Sequence

from marsupial.model.grid import Mask
from marsupial.model.mission import MissionEvent
from marsupial.model.strategy import PlanningReport


class Observer:
    """Watches a mission; every method may be left as it is."""

    def reachable(self, area: Mask) -> None:
        """Take in, before the first event, which cells (height, width) there are to explore."""

    def event(self, event: MissionEvent) -> None:
        """Take in what happened (simulated time only)."""

    def planned(self, report: PlanningReport) -> None:
        """Take in how a planning went (wall-clock time)."""

    def waiting(self, reason: str) -> None:
        """Take in why the mission waits for a better map; nothing once it goes on."""

    def analysing(self) -> None:
        """Take in that it begins to be worked out what the map means."""

    def analysed(self) -> None:
        """Take in that this is done, for now."""


class Observers(Observer):
    """Passes everything on to several observers."""

    def __init__(self, observers: Sequence[Observer]) -> None:
        self._observers = tuple(observers)

    def reachable(self, area: Mask) -> None:
        """Pass on what there is to explore."""
        for observer in self._observers:
            observer.reachable(area)

    def event(self, event: MissionEvent) -> None:
        """Pass an event on."""
        for observer in self._observers:
            observer.event(event)

    def planned(self, report: PlanningReport) -> None:
        """Pass a report on."""
        for observer in self._observers:
            observer.planned(report)

    def waiting(self, reason: str) -> None:
        """Pass on why the mission waits."""
        for observer in self._observers:
            observer.waiting(reason)

    def analysing(self) -> None:
        """Pass on that an analysis begins."""
        for observer in self._observers:
            observer.analysing()

    def analysed(self) -> None:
        """Pass on that an analysis is done."""
        for observer in self._observers:
            observer.analysed()
