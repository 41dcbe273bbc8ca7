"""The lines of a mission log: events as JSON objects, written and read in order.

::

    {"event":"mission","format":"marsupial-log","version":3, ...}
    {"event":"reveal","t_ms":250,"robot":"r1","cells":[812,3,1,57,4,1]}
    {"event":"plan", ..., "targets":["t_812", {"name":"t_930", ...}], ...}

A line has the fields of its event's class in their declared order, so the same events are always the same bytes.
Two things keep logs small:

- Cells are runs with the number of cells between them instead of their starts (`_gaps`): the numbers are small, and
  gzip finds the rows of a view, which resemble each other.
- A target or meeting point that is equal to one of the previous plan is replaced by its name.

So `LogEncoder` and `LogDecoder` hold the parts of the last plan. Reading follows the type hints of the event classes
(`_read`): a new field needs no code here. The format for other programs: ``docs/mission-log.md``.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from marsupial.errors import LogError, Problem
from marsupial.formats.jsonvalues import JsonFault, parse_json
from marsupial.model import Cause, Cell, Trigger, Triggers
from marsupial.model import mission as m
from marsupial.model.bounds import MOST
from marsupial.model.runs import Runs, triples

FORMAT = "marsupial-log"
VERSION = 3  # 1 and 2 had other cells

EVENTS: dict[str, type[m.MissionEvent]] = {
    "mission": m.MissionStarted,
    "reveal": m.Revealed,
    "drive": m.DriveStarted,
    "stand": m.DriveEnded,
    "plan": m.Planned,
    "start": m.ActionStarted,
    "end": m.ActionEnded,
    "lost": m.RobotLost,
    "returned": m.RobotReturned,
    "away": m.ContactLost,
    "contact": m.ContactRegained,
    "speed": m.SpeedChanged,
    "zone": m.ZoneChanged,
    "ended": m.MissionEnded,
    "change": m.Changed,
    "frame": m.FrameGrown,
}
"""The event class of each line's `event`."""

# fields that lines lack where robots share cells, have no battery, no seats by type, see all around, are in contact
# everywhere, or are not lost; and where a strategy gives no reasons
LEFT_OUT = frozenset(
    {"interference", "chargers", "charges", "battery", "seats", "sensor_angle_deg", "radio_range_m", "lost"}
    | {"guess", "compared", "instead"}
)
_TAGS = {kind: tag for tag, kind in EVENTS.items()}
_NAMED = ("targets", "meetings")  # lists of a plan in which the next plan may give names alone


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """A line of cells; see `_gaps`."""

    t_ms: int
    robot: str
    cells: tuple[int, ...]


class LogEncoder:
    """Writes the events of one mission as lines, without line breaks; plain ASCII."""

    def __init__(self) -> None:
        self._before: dict[str, dict[str, object]] = {}

    def line(self, event: m.MissionEvent) -> str:
        head: dict[str, Any] = {"event": _TAGS[type(event)]}
        values = _object(event)
        if isinstance(event, m.Revealed | m.Changed):
            values["cells"] = _gaps(values.pop("runs"))
        elif isinstance(event, m.MissionStarted):
            head |= {"format": FORMAT, "version": VERSION}
        elif isinstance(event, m.Planned):
            values["trigger"] = trigger_text(event.trigger)
            for part in _NAMED:
                # Items equal to those of the previous plan are written as names alone.
                before, things = self._before.get(part, {}), values[part]
                self._before[part] = {thing.name: thing for thing in things}
                values[part] = [thing.name if before.get(thing.name) == thing else thing for thing in things]
        return _json(head | values)


def log_lines(events: Iterable[m.MissionEvent]) -> Iterator[str]:
    """Yield the lines of a mission's log, without line breaks."""
    yield from map(LogEncoder().line, events)


def _gaps(runs: Sequence[int]) -> list[int]:
    """Return flat runs (start, length, code) with the cells since the end of the run before instead of each start."""
    gaps: list[int] = []
    end = 0
    for start, length, code in triples(runs):
        gaps += (start - end, length, code)
        end = start + length
    return gaps


def _runs(gaps: Sequence[int]) -> Runs:
    """Return the runs of `_gaps`; raise a `ValueError` if they are not three numbers each."""
    runs: list[int] = []
    end = 0
    for gap, length, code in triples(gaps):
        runs += (end + gap, length, code)
        end += gap + length
    return tuple(runs)


def _object(value: Any) -> dict[str, Any]:
    given = ((name, getattr(value, name)) for name in _hints(value.__class__))
    return {name: one for name, one in given if one or name not in LEFT_OUT}


def _plain(value: Any) -> Any:
    if is_dataclass(value):
        return _object(value)
    if isinstance(value, frozenset):
        return sorted(value)
    if isinstance(value, np.integer):
        return int(value)
    raise TypeError(f"a mission log has no way to write {value!r}")


_json = json.JSONEncoder(default=_plain, separators=(",", ":"), allow_nan=False).encode


class LogDecoder:
    """Reads the lines of one log in order."""

    def __init__(self) -> None:
        self._before: dict[str, dict[str, object]] = {}

    def event(self, line: str) -> m.MissionEvent:
        """Return the event of the next line, for `LogChecker` to check; raise a `LogError` if it is invalid."""
        problems: list[Problem] = []
        event = self.read(line.encode(), problems)
        if event is None:
            raise LogError(problems)
        return event

    def read(self, line: bytes, problems: list[Problem]) -> m.MissionEvent | None:
        """Return the event of the next line; None, with its problems added to `problems`, if it has any."""
        value = _load_object(line, problems)
        if value is None:
            return None
        tag = value.pop("event", None)
        if not isinstance(tag, str) or tag not in EVENTS:
            problems.append(Problem("event", f"must be one of {', '.join(EVENTS)}, got {_shown(tag)}"))
            return None
        kind: Any = EVENTS[tag]
        if kind is m.MissionStarted:
            _check_format(value, problems)
        elif kind is m.Planned:
            self._add_named(value, problems)
        elif kind in (m.Revealed, m.Changed):
            look = _read_object(_Look, value, "", problems)
            return None if look is None else _seen(kind, look, problems)
        event: m.MissionEvent | None = None if problems else _read_object(kind, value, "", problems)
        return event

    def _add_named(self, plan: dict[str, Any], problems: list[Problem]) -> None:
        """Replace names in a plan by the items of the previous plan."""
        for part in _NAMED:
            things = plan.get(part)
            if not isinstance(things, list):
                continue
            before = self._before.get(part, {})
            for i, name in enumerate(things):
                if isinstance(name, str) and name in before:
                    things[i] = before[name]
                elif isinstance(name, str):
                    problems.append(Problem(f"{part}[{i}]", f"does not stand in the plan before: {_shown(name)}"))
            named = [thing for thing in things if isinstance(thing, Mapping)]
            self._before[part] = {thing["name"]: thing for thing in named if isinstance(thing.get("name"), str)}


def _check_format(first: dict[str, Any], problems: list[Problem]) -> None:
    """Take format and version out of a log's first line, and check that it can be read here."""
    name, version = first.pop("format", None), first.pop("version", None)
    if name != FORMAT:
        problems.append(Problem("format", f'must be "{FORMAT}", got {_shown(name)}'))
    elif type(version) is not int or version != VERSION:
        problems.append(Problem("version", f"must be {VERSION}, got {_shown(version)}: other versions can't be read"))


def _seen(kind: type[m.Revealed | m.Changed], look: _Look, problems: list[Problem]) -> m.MissionEvent | None:
    try:
        return kind(t_ms=look.t_ms, robot=look.robot, runs=_runs(look.cells))
    except ValueError:
        problems.append(Problem("cells", f"must be three numbers for each run, got {len(look.cells)} numbers"))
        return None


def _load_object(line: bytes, problems: list[Problem]) -> dict[str, Any] | None:
    try:
        value = parse_json(line.decode())
    except UnicodeDecodeError:
        fault = "is not UTF-8 text"
    except JsonFault as error:
        fault = f"is not JSON: {error}"
    else:
        if isinstance(value, dict):
            return value
        fault = f"must be a JSON object, got {_shown(value)}"
    problems.append(Problem("", fault))
    return None


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."


@cache
def _hints(kind: type) -> dict[str, tuple[Any, bool]]:
    """Return each field's type, and whether it is required."""
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
    """Return `value` as the type `hint`; if it can't be, add the problems and return anything."""
    if hint in _NAMES:
        return _read_scalar(hint, value, path, problems)
    if get_origin(hint) is UnionType:
        (inner,) = (kind for kind in get_args(hint) if kind is not NoneType)
        return None if value is None else _read(inner, value, path, problems)
    if hint == Triggers:
        return read_triggers(_read_scalar(str, value, path, problems))
    if hint is Cell:
        return Cell(*_read_array((int, int), value, path, problems))
    if get_origin(hint) in (tuple, frozenset):
        # tuple[X, ...] has an Ellipsis for any number of items; frozenset[X] has none, but means the same.
        items = (*get_args(hint), ...) if get_origin(hint) is frozenset else get_args(hint)
        return get_origin(hint)(_read_array(items, value, path, problems))
    if is_dataclass(hint):
        return _read_object(hint, value, path, problems)  # type: ignore[arg-type]
    if isinstance(value, str) and value in set(hint):  # a `StrEnum`
        return hint(value)
    problems.append(Problem(path, f"must be one of {', '.join(hint)}, got {_shown(value)}"))
    return None


def _read_array(hints: tuple[Any, ...], value: Any, path: str, problems: list[Problem]) -> tuple[Any, ...]:
    repeats = hints[-1] is ...
    if not isinstance(value, list) or (not repeats and len(value) != len(hints)):
        wanted = "an array" if repeats else f"an array of {len(hints)}"
        problems.append(Problem(path, f"must be {wanted}, got {_shown(value)}"))
        return () if repeats else tuple(0 for _ in hints)
    if repeats and hints[0] in _NAMES and all(type(item) is hints[0] for item in value):
        return tuple(value)  # a shortcut for the usual case: long arrays of one scalar type
    kinds = [hints[0]] * len(value) if repeats else hints
    return tuple(_read(kinds[i], item, f"{path}[{i}]", problems) for i, item in enumerate(value))


_NAMES = {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}


def _read_scalar(hint: type, value: Any, path: str, problems: list[Problem]) -> Any:
    # `type`, not `isinstance`: a bool is an int to Python, but no number in a log.
    if hint is float and type(value) is int and abs(value) <= MOST:
        return float(value)
    if type(value) is hint is int and abs(value) > MOST:
        problems.append(Problem(path, f"must be at most {MOST:g}, got {_shown(value)}"))
        return 0
    if type(value) is not hint:
        problems.append(Problem(path, f"must be {_NAMES[hint]}, got {_shown(value)}"))
        return hint()
    return value


def trigger_text(triggers: Triggers) -> str:
    """Return the triggers of a replanning as text, such as ``gone: t1; new: t2, t3``, for logs and people."""
    return "; ".join(_words(trigger) for trigger in triggers)


def read_triggers(text: str) -> Triggers:
    """Return the triggers that a text lists; any other text becomes one trigger with `Cause.OTHER`."""
    triggers = tuple(_trigger(words) for words in text.split("; "))
    return triggers if trigger_text(triggers) == text else (Trigger(Cause.OTHER, (text,)),)


def _words(trigger: Trigger) -> str:
    names = ", ".join(trigger.names)
    if trigger.cause is Cause.OTHER:
        return names
    return f"{trigger.cause}: {names}" if names else str(trigger.cause)


def _trigger(words: str) -> Trigger:
    cause, _, names = words.partition(": ")
    if cause not in set(Cause):
        return Trigger(Cause.OTHER, (words,))
    return Trigger(Cause(cause), tuple(names.split(", ")) if names else ())
