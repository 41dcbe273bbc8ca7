"""The log of a mission that the command line runs."""

from __future__ import annotations

from marsupial.cli.outputs import writing
from marsupial.library.recording import LogFile
from marsupial.model.mission import MissionEvent


class MissionLog(LogFile):
    """Reports what can't be written as a `UsageError`."""

    def __exit__(self, *_: object) -> None:
        with writing(self.path):
            super().__exit__()

    def event(self, event: MissionEvent) -> None:
        """Write an event."""
        with writing(self.path):
            super().event(event)
