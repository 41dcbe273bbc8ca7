"""Observers that pass a mission's events on: to memory, to a function of the caller, to a mission log."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from marsupial.formats.files import writing
from marsupial.formats.loglines import LogEncoder
from marsupial.mission.observer import Observer
from marsupial.model.mission import MissionEvent


class Recorder(Observer):
    """Records events in memory."""

    def __init__(self) -> None:
        self.events: list[MissionEvent] = []

    def event(self, event: MissionEvent) -> None:
        self.events.append(event)


class Caller(Observer):
    """Calls a function with each event."""

    def __init__(self, call: Callable[[MissionEvent], object]) -> None:
        self._call = call

    def event(self, event: MissionEvent) -> None:
        self._call(event)


class LogFile(Observer):
    """Writes the log, each event at once; creates the file at the first.

    Raises a `UsageError` if it can't be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._encoder = LogEncoder()
        self._file: TextIO | None = None

    def __enter__(self) -> LogFile:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            with writing(self.path):
                self._file.close()

    def event(self, event: MissionEvent) -> None:
        with writing(self.path):
            if self._file is None:
                self._file = self.path.open("w", encoding="ascii", newline="\n")
            self._file.write(self._encoder.line(event) + "\n")
            self._file.flush()  # a killed run loses at most one line
