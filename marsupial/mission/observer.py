"""Observers of a mission: they receive every event and the result of each planning call.

The mission loop itself prints and writes nothing. Logs, progress displays and statistics are observers, which override
the methods that they need. `Observers` passes everything on to several of them.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from marsupial.model import Mask, MissionEvent, PlanningReport


class Observer:
    """Base class of observers; no method has to be overridden."""

    def reachable(self, area: Mask) -> None:
        """Called before the first event with the cells (height, width) to explore."""

    def event(self, event: MissionEvent) -> None:
        """Called with each event, which holds simulated time only."""

    def planned(self, report: PlanningReport) -> None:
        """Called after each planning call, with wall-clock times."""

    def waiting(self, reason: str) -> None:
        """Called when the mission starts to wait for a better map or for lost robots, and with "" when it resumes."""

    def analysing(self) -> None:
        """Called when an analysis of the map begins."""

    def analysed(self) -> None:
        """Called when that analysis is finished."""

    @contextmanager
    def analysis(self) -> Iterator[None]:
        """Call `analysing` and `analysed` around an analysis: its time is reported separately from planning."""
        self.analysing()
        try:
            yield
        finally:
            self.analysed()


class Observers(Observer):
    """Passes everything on to several observers."""

    def __init__(self, observers: Sequence[Observer]) -> None:
        self._observers = tuple(observers)

    def reachable(self, area: Mask) -> None:
        for observer in self._observers:
            observer.reachable(area)

    def event(self, event: MissionEvent) -> None:
        for observer in self._observers:
            observer.event(event)

    def planned(self, report: PlanningReport) -> None:
        for observer in self._observers:
            observer.planned(report)

    def waiting(self, reason: str) -> None:
        for observer in self._observers:
            observer.waiting(reason)

    def analysing(self) -> None:
        for observer in self._observers:
            observer.analysing()

    def analysed(self) -> None:
        for observer in self._observers:
            observer.analysed()
