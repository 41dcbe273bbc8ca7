"""Observers that pass a mission's events on: to memory, to a function of the caller, to a mission log."""

from __future__ import annotations

from collections.abc import Callable, Iterable
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
    """Writes the log; creates the file at the first event, and raises a `UsageError` if it can't be written.

    Each event is written at once, but `Revealed` events wait for another kind of event.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._encoder = LogEncoder()
        self._file: TextIO | None = None

    def __enter__(self) -> LogFile:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            with writing(self.path), self._file:
                self._write(self._file, self._encoder.rest())

    def event(self, event: MissionEvent) -> None:
        with writing(self.path):
            if self._file is None:
                self._file = self.path.open("w", encoding="ascii", newline="\n")
            self._write(self._file, self._encoder.lines(event))

    def _write(self, file: TextIO, lines: Iterable[str]) -> None:
        for line in lines:
            file.write(line + "\n")
            file.flush()  # a killed run loses at most one line
