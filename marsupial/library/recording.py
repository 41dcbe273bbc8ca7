"""Observers that record a mission's events in memory or in a mission log."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from marsupial.formats.files import writing
from marsupial.formats.missionlog import LogWriter
from marsupial.mission.observer import Observer
from marsupial.model.mission import MissionEvent


class Recorder(Observer):
    """Records events in memory."""

    def __init__(self) -> None:
        self.events: list[MissionEvent] = []

    def event(self, event: MissionEvent) -> None:
        self.events.append(event)


class LogFile(Observer):
    """Writes the log; creates the file at the first event, and raises a `UsageError` if it can't be written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._stack = ExitStack()
        self._writer: LogWriter | None = None

    def __enter__(self) -> LogFile:
        return self

    def __exit__(self, *_: object) -> None:
        with writing(self.path):
            self._stack.close()

    def event(self, event: MissionEvent) -> None:
        with writing(self.path):
            if self._writer is None:
                self._writer = self._stack.enter_context(LogWriter(self.path))
            self._writer.write(event)
