"""Mission logs: one JSON object a line, one line an event, written as the mission goes.

A line is `{"event": tag, ...}` with the fields of that event's class in their declared order, so the same events
are always the same bytes; the first line says which format and version it is. Every line is flushed, so a killed
run leaves whole lines and at most one that is cut off. Reading is the mirror image, driven by the type hints of the
event classes, and checks all that a replay relies on. The format for other programs: ``docs/mission-log.md``.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import MISSING, dataclass, fields, is_dataclass
from enum import StrEnum
from functools import cache
from os import PathLike
from pathlib import Path
from types import NoneType, TracebackType, UnionType
from typing import Any, TextIO, get_args, get_origin, get_type_hints

import numpy as np

from marsupial.errors import LogError, Problem
from marsupial.formats.logchecks import LogChecker
from marsupial.formats.triggers import read_triggers, trigger_text
from marsupial.model import mission as m
from marsupial.model.grid import Cell

FORMAT = "marsupial-log"
VERSION = 1

EVENTS: dict[str, type[m.MissionEvent]] = {
    "mission": m.MissionStarted,
    "reveal": m.Revealed,
    "drive": m.DriveStarted,
    "stand": m.DriveEnded,
    "plan": m.Planned,
    "start": m.ActionStarted,
    "end": m.ActionEnded,
    "lost": m.RobotLost,
    "ended": m.MissionEnded,
}
"""What each line's `event` stands for."""

_TAGS = {kind: tag for tag, kind in EVENTS.items()}
_MOST_PROBLEMS = 50  # a file of another kind has a problem on every line


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionLog:
    """What a log file holds.

    Parameters
    ----------
    truncated
        Whether its last line was cut off; that line is not among the events.
    """

    events: tuple[m.MissionEvent, ...]
    truncated: bool = False

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


def encode_event(event: m.MissionEvent) -> str:
    """Return the line of an event, without its line break; plain ASCII."""
    head: dict[str, Any] = {"event": _TAGS[type(event)]}
    if isinstance(event, m.MissionStarted):
        head |= {"format": FORMAT, "version": VERSION}
    values = _object(event)
    if isinstance(event, m.Planned):
        values["trigger"] = trigger_text(event.trigger)
    return json.dumps(head | values, default=_plain, separators=(",", ":"), allow_nan=False)


def decode_event(line: str) -> m.MissionEvent:
    """Return the event of one line; what has to hold between lines is not looked at.

    Raises
    ------
    LogError
        If it is none.
    """
    problems: list[Problem] = []
    event = _read_line(line.encode(), problems)
    if event is None:
        raise LogError(problems)
    return event


def _object(value: Any) -> dict[str, Any]:
    return {field.name: getattr(value, field.name) for field in fields(value)}


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return _object(value)
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, np.integer):
        return int(value)
    raise TypeError(f"a mission log has no way to write {value!r}")


class LogWriter:
    """Writes events to a file or a text stream, each at once.

    A file it opened is closed on exit; a stream it was given is left open.
    """

    def __init__(self, target: str | PathLike[str] | TextIO) -> None:
        self._target = target
        self._stack = ExitStack()
        self._stream: TextIO | None = None

    def __enter__(self) -> LogWriter:
        if isinstance(self._target, str | PathLike):
            file = Path(self._target).open("w", encoding="ascii", newline="\n")
            self._stream = self._stack.enter_context(file)
        else:
            self._stream = self._target
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stream = None
        self._stack.close()

    def write(self, event: m.MissionEvent) -> None:
        """Append one event."""
        if self._stream is None:
            raise ValueError("a LogWriter writes only inside its with block")
        self._stream.write(encode_event(event) + "\n")
        self._stream.flush()


def read_log(path: str | PathLike[str]) -> MissionLog:
    """Read a log file; `-` is standard input.

    Raises
    ------
    LogError
        With every problem found (the first 50), each with its line and field.
    """
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
        _load(line)
    except (ValueError, RecursionError):
        return False
    return True


def _read_lines(lines: Iterable[bytes]) -> tuple[list[m.MissionEvent], list[Problem]]:
    events: list[m.MissionEvent] = []
    problems: list[Problem] = []
    checker = LogChecker()
    for number, line in enumerate(lines, start=1):
        found: list[Problem] = []
        event = _read_line(line, found)
        if event is not None:
            events.append(event)
            found += checker.check(event)
        problems += [Problem(f"line {number}: {p.path}" if p.path else f"line {number}", p.message) for p in found]
        if len(problems) >= _MOST_PROBLEMS or (problems and number == 1):
            break  # without a good first line nothing below it can be judged
    return events, problems[:_MOST_PROBLEMS]


def _read_line(line: bytes, problems: list[Problem]) -> m.MissionEvent | None:
    try:
        value = _load(line)
    except (ValueError, RecursionError) as error:
        problems.append(Problem("", f"is not JSON: {error}"))
        return None
    if not isinstance(value, dict):
        problems.append(Problem("", f"must be a JSON object, got {_shown(value)}"))
        return None
    tag = value.pop("event", None)
    if not isinstance(tag, str) or tag not in EVENTS:
        problems.append(Problem("event", f"must be one of {', '.join(EVENTS)}, got {_shown(tag)}"))
        return None
    if tag == "mission":
        _check_header(value, problems)
    event = None if problems else _read_object(EVENTS[tag], value, "", problems)
    return None if problems else event


def _load(line: bytes) -> Any:
    return json.loads(line.decode("utf-8"), parse_constant=_refuse_constant)


def _refuse_constant(name: str) -> None:
    raise ValueError(f"{name} is not a number")


def _check_header(value: dict[str, Any], problems: list[Problem]) -> None:
    name, version = value.pop("format", None), value.pop("version", None)
    if name != FORMAT:
        problems.append(Problem("format", f'must be "{FORMAT}", got {_shown(name)}'))
    elif version != VERSION or isinstance(version, bool):
        problems.append(Problem("version", f"must be {VERSION}, the only one known here, got {_shown(version)}"))


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."


@cache
def _hints(kind: type) -> dict[str, tuple[Any, bool]]:
    """Return each field's type and whether it must be there."""
    hints = get_type_hints(kind)
    return {
        field.name: (hints[field.name], field.default is MISSING and field.default_factory is MISSING)
        for field in fields(kind)
    }


def _read_object(kind: type, value: Any, path: str, problems: list[Problem]) -> Any:
    if not isinstance(value, dict):
        problems.append(Problem(path, f"must be an object, got {_shown(value)}"))
        return None
    before = len(problems)
    hints = _hints(kind)
    problems += [Problem(_below(path, name), "is not a field of this event") for name in value if name not in hints]
    given = {}
    for name, (hint, required) in hints.items():
        if name in value:
            given[name] = _read(hint, value[name], _below(path, name), problems)
        elif required:
            problems.append(Problem(_below(path, name), "is missing"))
    return kind(**given) if len(problems) == before else None


def _below(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _read(hint: Any, value: Any, path: str, problems: list[Problem]) -> Any:
    """Return `value` as the type `hint` says; where it can't be, add the problems and return anything."""
    if get_origin(hint) is UnionType:
        (inner,) = (kind for kind in get_args(hint) if kind is not NoneType)
        return None if value is None else _read(inner, value, path, problems)
    if hint == m.Triggers:
        return read_triggers(_read_scalar(str, value, path, problems))
    if hint is Cell:
        return Cell(*_read_array((int, int), value, path, problems))
    if get_origin(hint) in (tuple, frozenset):
        return get_origin(hint)(_read_array(_item_hints(hint), value, path, problems))
    if is_dataclass(hint):
        return _read_object(hint, value, path, problems)  # type: ignore[arg-type]
    if issubclass(hint, StrEnum):
        return _read_enum(hint, value, path, problems)
    return _read_scalar(hint, value, path, problems)


def _item_hints(hint: Any) -> tuple[Any, ...]:
    """Return the types of an array's items; of one that repeats, the type and an Ellipsis."""
    return (*get_args(hint), ...) if get_origin(hint) is frozenset else get_args(hint)


def _read_array(hints: tuple[Any, ...], value: Any, path: str, problems: list[Problem]) -> tuple[Any, ...]:
    repeats = hints[-1] is ...
    if not isinstance(value, list) or (not repeats and len(value) != len(hints)):
        wanted = "an array" if repeats else f"an array of {len(hints)}"
        problems.append(Problem(path, f"must be {wanted}, got {_shown(value)}"))
        return () if repeats else tuple(0 for _ in hints)
    if repeats and hints[0] in _NAMES and all(type(item) is hints[0] for item in value):
        return tuple(value)  # the usual case, and what makes long runs fast to read
    kinds = [hints[0]] * len(value) if repeats else hints
    return tuple(_read(kinds[i], item, f"{path}[{i}]", problems) for i, item in enumerate(value))


def _read_enum(hint: type[StrEnum], value: Any, path: str, problems: list[Problem]) -> StrEnum | None:
    if isinstance(value, str) and value in set(hint):
        return hint(value)
    problems.append(Problem(path, f"must be one of {', '.join(hint)}, got {_shown(value)}"))
    return None


_NAMES = {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}


def _read_scalar(hint: type, value: Any, path: str, problems: list[Problem]) -> Any:
    if hint is float and type(value) is int and abs(value) < 2**1023:
        return float(value)
    if type(value) is not hint or value in (float("inf"), float("-inf")):
        problems.append(Problem(path, f"must be {_NAMES[hint]}, got {_shown(value)}"))
        return hint()
    return value
