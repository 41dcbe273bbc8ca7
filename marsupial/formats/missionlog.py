"""Mission logs: files of one JSON object per line, written during the mission.

If the run is killed, the log is valid but for its last line, which may be cut off. Reading checks everything that a
replay relies on. The content of lines: `marsupial.formats.loglines`; the format for other programs:
``docs/mission-log.md``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from marsupial.errors import LogError, Problem
from marsupial.formats.logchecks import LogChecker
from marsupial.formats.loglines import LogDecoder, load
from marsupial.model import mission as m

_MOST_PROBLEMS = 50  # a file of another kind has a problem on every line


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionLog:
    """The content of a log file."""

    events: tuple[m.MissionEvent, ...]
    truncated: bool = False  # whether its last line was cut off; that line is not among the events

    @property
    def mission(self) -> m.MissionStarted:
        """The first event."""
        first = self.events[0]
        assert isinstance(first, m.MissionStarted)
        return first

    @property
    def ended(self) -> m.MissionEnded | None:
        """The stop report, or None if the run was killed before it could write one."""
        last = self.events[-1]
        return last if isinstance(last, m.MissionEnded) else None


def read_log(path: str | PathLike[str]) -> MissionLog:
    """Read a log file, `-` for standard input; a `LogError` has the first 50 problems with their lines and fields."""
    try:
        data = sys.stdin.buffer.read() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise LogError(f"can't be read: {error.strerror}", source=str(path)) from error
    return parse_log(data, source=str(path))


def parse_log(data: bytes, *, source: str = "") -> MissionLog:
    """Read the bytes of a log; see `read_log`."""
    lines = data.splitlines(keepends=True)
    cut_off = bool(lines) and not lines[-1].endswith(b"\n") and not _is_json(lines[-1])
    events, problems = _read_lines(lines[:-1] if cut_off else lines)
    if not events and not problems:
        problems = [Problem("", "holds no mission: it is empty or its first line was cut off")]
    if problems:
        raise LogError(problems, source=source)
    return MissionLog(events=tuple(events), truncated=cut_off)


def _is_json(line: bytes) -> bool:
    try:
        load(line)
    except (ValueError, RecursionError):
        return False
    return True


def _read_lines(lines: Iterable[bytes]) -> tuple[list[m.MissionEvent], list[Problem]]:
    events: list[m.MissionEvent] = []
    problems: list[Problem] = []
    decoder, checker = LogDecoder(), LogChecker()
    for number, line in enumerate(lines, start=1):
        found: list[Problem] = []
        for event in decoder.read(line, found):
            events.append(event)
            found += checker.check(event)
        problems += [Problem(f"line {number}: {p.path}" if p.path else f"line {number}", p.message) for p in found]
        if len(problems) >= _MOST_PROBLEMS or (problems and number == 1):
            break  # the checks of all other lines need a valid first line
    return events, problems[:_MOST_PROBLEMS]
