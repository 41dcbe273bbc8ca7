"""A small file with what a bridge needs to resume its mission after it was stopped or killed.

The bridge writes it before it sends goals or a report, so the file covers everything the bridge has done. It includes
the report that may not have arrived; the service knows whether it has.
"""

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from marsupial.errors import InputError, UsageError
from marsupial.formats.files import read_text, replace_file
from marsupial.formats.jsonvalues import parse_json
from marsupial.formats.mapfiles.images import MAX_CELLS
from marsupial_client.mission_documents import Command, Report

VERSION = 1

MOST_BYTES = 64 * 2**20


@dataclass(slots=True, kw_only=True)
class Record:
    """The progress of a mission that began with the `frame` of its brief and was resumed `starts` times.

    `after` is the last event acted on, `answered` the report that the last commands answered, `until_ms` when the next
    report is due; `report` may not have arrived. `active_commands` have not ended, `unreported` is what to report next
    (`team.UnreportedEvents`), `aboard` maps each rover aboard to its carrier, `away` are the rovers out of contact.
    """

    mission: str
    frame: dict[str, Any]
    after: int = 0
    answered: int = -1
    until_ms: int | None = None
    active_commands: list[Command] = field(default_factory=list)
    aboard: dict[str, str] = field(default_factory=dict)
    starts: int = 0
    lost: list[str] = field(default_factory=list)
    away: list[str] = field(default_factory=list)
    report: Report | None = None
    unreported: dict[str, Any] = field(default_factory=dict)

    @property
    def robots(self) -> set[str]:
        return {command["robot"] for command in self.active_commands} | {*self.lost, *self.away, *self.aboard}

    def check(self) -> None:
        """Check a record read from the file. Raises ValueError, TypeError, KeyError if it is malformed."""
        width, height, (_, _, _) = self.frame["width"], self.frame["height"], self.frame["origin_m"]
        texts, numbers = [self.mission, *self.robots], [self.after, self.answered, self.starts, width, height]
        if not all(isinstance(one, str) for one in texts) or not all(isinstance(one, int) for one in numbers):
            raise TypeError("a name or number is invalid")
        if min(width, height) < 1 or width * height > MAX_CELLS:
            raise ValueError(f"a frame of {width} x {height} cells")


class Journal:
    """The journal file; without a path nothing is stored."""

    def __init__(self, path: Path | None) -> None:
        self.path = path

    def read(self) -> Record | None:
        """Return the stored record, None without a file. Raises InputError, or UsageError if none can be written."""
        if self.path is None:
            return None
        # check now, before a mission begins that could not be saved
        if not os.access(self.path.parent, os.W_OK | os.X_OK):
            raise UsageError(f"--state: {self.path} can't be written (its folder is missing or read-only)")
        if not self.path.exists():
            return None
        text = read_text(self.path, InputError, MOST_BYTES)
        try:
            document = parse_json(text)
            if document.pop("version") != VERSION:
                raise ValueError("unsupported version")
            record = Record(**document)
            record.check()
            return record
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise InputError(f"is not a state file of `marsupial ros` ({error})", source=str(self.path)) from error

    def write(self, record: Record) -> None:
        """Replace the stored record. Raises UsageError if the file can't be written."""
        if self.path is None:
            return
        try:
            # atomically: the bridge may be killed at any moment
            replace_file(self.path, json.dumps({"version": VERSION, **asdict(record)}).encode())
        except OSError as error:
            raise UsageError(f"--state: {self.path} can't be written ({error.strerror})") from error

    def forget(self) -> None:
        """Remove the file: the mission is over."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
