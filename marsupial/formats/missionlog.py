"""Mission logs: files of one JSON object per line, written during the mission, and how they are read and checked.

If the run is killed, the log is valid except for its last line, which may be cut off. A log whose lines are well formed
can still be wrong: an unknown robot, cells off the map, time running backwards. `LogChecker` refuses whatever a replay
can't cope with, so that callers of `read_log` need not check again. The content of lines: `marsupial.formats.loglines`;
the format for other programs: ``docs/mission-log.md``.
"""

import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from marsupial.errors import LogError, Problem
from marsupial.formats.files import utf8
from marsupial.formats.jsonvalues import parse_json
from marsupial.formats.loglines import LogDecoder
from marsupial.formats.mapfiles.images import MAX_CELLS
from marsupial.model import UNKNOWN, Action, ActionName, Cell, DatedZone, RobotType, Role
from marsupial.model import mission as m
from marsupial.model.bounds import BOUNDS, field_problems
from marsupial.model.runs import runs_fault
from marsupial.model.zones import zone_faults
from marsupial.paths.routes import route_of

_MOST_PROBLEMS = 50  # a file of another kind has a problem on every line


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionLog:
    """The content of a log file."""

    events: tuple[m.MissionEvent, ...]
    truncated: bool = False  # whether its last line was cut off; that line is not among the events


def read_log(path: str | PathLike[str]) -> MissionLog:
    """Read a log file, `-` for standard input; a `LogError` has the first 50 problems with their lines and fields."""
    try:
        data = sys.stdin.buffer.read() if str(path) == "-" else Path(path).read_bytes()
    except OSError as error:
        raise LogError(f"can't be read: {error.strerror}", source=str(path)) from error
    return parse_log(data, source=str(path))


def parse_log(data: bytes, *, source: str = "") -> MissionLog:
    """Read the bytes of a log; see `read_log`."""
    lines = utf8(data).splitlines(keepends=True)
    cut_off = bool(lines) and not lines[-1].endswith(b"\n") and not _is_json(lines[-1])
    events, problems = _read_lines(lines[:-1] if cut_off else lines)
    if not events and not problems:
        problems = [Problem("", "holds no mission: it is empty or its first line was cut off")]
    if problems:
        raise LogError(problems, source=source)
    return MissionLog(events=tuple(events), truncated=cut_off)


def _is_json(line: bytes) -> bool:
    try:
        parse_json(line.decode())
    except ValueError:
        return False
    return True


def _read_lines(lines: Iterable[bytes]) -> tuple[list[m.MissionEvent], list[Problem]]:
    events: list[m.MissionEvent] = []
    problems: list[Problem] = []
    decoder, checker = LogDecoder(), LogChecker()
    for number, line in enumerate(lines, start=1):
        found: list[Problem] = []
        event = decoder.read(line, found)
        if event is not None:
            events.append(event)
            found += checker.check(event)
        problems += [Problem(f"line {number}: {p.path}" if p.path else f"line {number}", p.message) for p in found]
        if len(problems) >= _MOST_PROBLEMS or (problems and number == 1):
            break  # the checks of all other lines need a valid first line
    return events, problems[:_MOST_PROBLEMS]


class LogChecker:
    """Checks the events of one log in their order."""

    def __init__(self) -> None:
        self._mission: m.MissionStarted | None = None
        self._width = self._height = 0
        self._codes: frozenset[int] = frozenset()
        self._robots: frozenset[str] = frozenset()
        self._carriers: frozenset[str] = frozenset()
        self._last_ms = 0
        self._over = False

    def check(self, event: m.MissionEvent) -> list[Problem]:
        problems = list(self._order(event))
        if self._mission is None:
            if not isinstance(event, m.MissionStarted):
                return [Problem("event", "the first event must be the mission")]
            self._mission = event
            self._width, self._height = event.width, event.height
            self._codes = frozenset(terrain.code for terrain in event.terrains)
            self._robots = frozenset(robot.name for robot in event.robots)
            carrying = {kind.name for kind in event.types if kind.role is Role.CARRIER}
            self._carriers = frozenset(robot.name for robot in event.robots if robot.type in carrying)
        self._last_ms = max(self._last_ms, event.t_ms)
        self._over = self._over or isinstance(event, m.MissionEnded)
        return problems + list(_CHECKS[type(event)](self, event))

    def _order(self, event: m.MissionEvent) -> Iterator[Problem]:
        if event.t_ms < self._last_ms:
            yield Problem("t_ms", f"must not go back, got {event.t_ms} after {self._last_ms}")
        if self._over:
            yield Problem("event", "nothing may follow the end of the mission")
        if self._mission is not None and isinstance(event, m.MissionStarted):
            yield Problem("event", "a log holds one mission")

    def _mission_started(self, event: m.MissionStarted) -> Iterator[Problem]:
        yield from self._frame(event)
        yield from field_problems(event, "", "resolution_m")
        for i, terrain in enumerate(event.terrains):
            if not 0 <= terrain.code < UNKNOWN:
                yield Problem(f"terrains[{i}].code", f"must be from 0 to {UNKNOWN - 1}, got {terrain.code}")
        for i, kind in enumerate(event.types):
            yield from _type_problems(kind, f"types[{i}]")
        if len(self._robots) < len(event.robots):
            yield Problem("robots", "two robots have the same name")
        types = {kind.name for kind in event.types}
        for i, robot in enumerate(event.robots):
            if robot.type not in types:
                yield Problem(f"robots[{i}].type", f"no such robot type: {robot.type!r}")
            yield from self._placed(f"robots[{i}]", robot)
        for i, cell in enumerate(event.chargers):
            yield from self._cell(f"chargers[{i}]", cell)

    def _frame(self, event: m.MissionStarted | m.FrameGrown) -> Iterator[Problem]:
        """Check the size and place of the map, before an array of that size is allocated."""
        yield from field_problems(event, "", "width", "height")
        if event.width * event.height > MAX_CELLS:
            yield Problem("width", f"{event.width} x {event.height} cells are more than the limit of {MAX_CELLS}")
        for i, metres in enumerate(event.origin_m):
            if fault := BOUNDS["coordinate_m"].fault(metres):
                yield Problem(f"origin_m[{i}]", fault)

    def _placed(self, path: str, robot: m.PlacedRobot) -> Iterator[Problem]:
        if (robot.cell is None) == (robot.carrier is None):
            yield Problem(path, "must have either a cell or a carrier")
        elif robot.cell is not None:
            yield from self._cell(f"{path}.cell", robot.cell)
        elif robot.carrier not in self._carriers:
            yield Problem(f"{path}.carrier", f"no such carrier: {robot.carrier!r}")
        elif robot.name in self._carriers:
            yield Problem(f"{path}.carrier", "a carrier can't be carried")

    def _revealed(self, event: m.Revealed | m.Changed) -> Iterator[Problem]:
        yield from self._robot("robot", event.robot)
        codes = self._codes | {UNKNOWN} if isinstance(event, m.Changed) else self._codes
        if fault := runs_fault(event.runs, self._width * self._height, codes):
            yield Problem("cells", fault)

    def _frame_grown(self, event: m.FrameGrown) -> Iterator[Problem]:
        yield from self._frame(event)
        shift = event.shift
        held = shift.x + self._width <= event.width and shift.y + self._height <= event.height
        if min(shift) < 0 or not held:
            yield Problem("shift", "must lead into a frame that holds the one before")
        else:
            self._width, self._height = event.width, event.height

    def _drive_started(self, event: m.DriveStarted) -> Iterator[Problem]:
        yield from self._robot_and_cell(event)
        if not set(event.steps) <= set("01234567"):
            yield Problem("steps", f"must be digits from 0 to 7, got {event.steps[:40]!r}")
        elif not all(map(self._contains, route_of(event.cell, event.steps))):
            yield Problem("steps", "leave the map")

    def _robot_and_cell(self, event: m.DriveStarted | m.DriveEnded) -> Iterator[Problem]:
        yield from self._robot("robot", event.robot)
        yield from self._cell("cell", event.cell)

    def _contact_lost(self, event: m.ContactLost) -> Iterator[Problem]:
        yield from self._robot("robot", event.robot)
        for path, cell in (("cell", event.cell), *((f"targets[{i}]", cell) for i, cell in enumerate(event.targets))):
            yield from self._cell(path, cell)

    def _speed_changed(self, event: m.SpeedChanged) -> Iterator[Problem]:
        yield from self._robot("robot", event.robot)
        if fault := BOUNDS["speed_share"].fault(event.share):
            yield Problem("share", fault)

    def _zone_changed(self, event: m.ZoneChanged) -> Iterator[Problem]:
        if event.zone is not None:
            dated = DatedZone(name=event.name, zone=event.zone)
            yield from (Problem(f"zone.{key}", fault) for key, fault in zone_faults(dated))

    def _planned(self, event: m.Planned) -> Iterator[Problem]:
        for i, target in enumerate(event.targets):
            yield from self._cell(f"targets[{i}].cell", target.cell)
        for i, meeting in enumerate(event.meetings):
            yield from self._cell(f"meetings[{i}].carrier_cell", meeting.carrier_cell)
            yield from self._cell(f"meetings[{i}].rover_cell", meeting.rover_cell)
        for i, action in enumerate(event.actions):
            yield from self._action(f"actions[{i}]", action)
        for i, (robot, share) in enumerate(event.charges):
            yield from self._robot(f"charges[{i}][0]", robot)
            if fault := BOUNDS["share"].fault(share):
                yield Problem(f"charges[{i}][1]", fault)
        if event.guess is not None and event.guess.side < 1:
            yield Problem("guess.side", f"must be 1 or more, got {event.guess.side}")
        for i, (robot, _) in enumerate(event.instead):
            yield from self._robot(f"instead[{i}][0]", robot)

    def _action_started(self, event: m.ActionStarted) -> Iterator[Problem]:
        yield from self._action("action", event.action)
        yield from self._cell("cell", event.cell)

    def _mission_ended(self, event: m.MissionEnded) -> Iterator[Problem]:
        for i, frontier in enumerate(event.remaining):
            yield from self._cell(f"remaining[{i}].cell", frontier.cell)

    def _action(self, path: str, action: Action) -> Iterator[Problem]:
        yield from self._robot(f"{path}.robot", action.robot)
        if action.name in (ActionName.DOCK, ActionName.UNDOCK):
            if action.carrier not in self._carriers:
                yield Problem(f"{path}.carrier", f"no such carrier: {action.carrier!r}")
            if action.robot in self._carriers:
                yield Problem(f"{path}.robot", "a carrier can't be carried")
        elif action.carrier is not None:
            yield Problem(f"{path}.carrier", f"a {action.name} has none, got {action.carrier!r}")
        if action.duration_ms < 0:
            yield Problem(f"{path}.duration_ms", f"must be 0 or more, got {action.duration_ms}")

    def _robot(self, path: str, name: str) -> Iterator[Problem]:
        if name not in self._robots:
            yield Problem(path, f"no such robot: {name!r}")

    def _cell(self, path: str, cell: Cell) -> Iterator[Problem]:
        if not self._contains(cell):
            yield Problem(path, f"lies outside the map: [{cell.x}, {cell.y}]")

    def _contains(self, cell: Cell) -> bool:
        return 0 <= cell.x < self._width and 0 <= cell.y < self._height


def _type_problems(kind: RobotType, path: str) -> Iterator[Problem]:
    numbers = "speed_mps", "sensor_range_m", "radius_m", "capacity", "dock_ms", "undock_ms", "diagonal"
    optional = [key for key in ("sensor_angle_deg", "radio_range_m") if getattr(kind, key) is not None]
    yield from field_problems(kind, f"{path}.", *numbers)
    yield from field_problems(kind.energy, f"{path}.energy.", "idle_w", "drive_w", "metre_j", "stop_j")
    yield from field_problems(kind, f"{path}.", *optional)
    if kind.battery is not None:
        yield from field_problems(kind.battery, f"{path}.battery.", "capacity_j", "charge_w")
    for i, (_, number) in enumerate(kind.seats):
        if fault := BOUNDS["capacity"].fault(number):
            yield Problem(f"{path}.seats[{i}][1]", fault)
    for i, joules in enumerate(kind.energy.turn_j):
        if fault := BOUNDS["energy_j"].fault(joules):
            yield Problem(f"{path}.energy.turn_j[{i}]", fault)


_CHECKS: dict[type, Callable[[LogChecker, Any], Iterator[Problem]]] = {
    m.MissionStarted: LogChecker._mission_started,
    m.Revealed: LogChecker._revealed,
    m.Changed: LogChecker._revealed,
    m.FrameGrown: LogChecker._frame_grown,
    m.DriveStarted: LogChecker._drive_started,
    m.DriveEnded: LogChecker._robot_and_cell,
    m.Planned: LogChecker._planned,
    m.ActionStarted: LogChecker._action_started,
    m.ActionEnded: lambda checker, event: checker._action("action", event.action),
    m.RobotLost: lambda checker, event: checker._robot("robot", event.robot),
    m.RobotReturned: lambda checker, event: checker._robot("robot", event.robot),
    m.ContactLost: LogChecker._contact_lost,
    m.ContactRegained: lambda checker, event: checker._robot("robot", event.robot),
    m.SpeedChanged: LogChecker._speed_changed,
    m.ZoneChanged: LogChecker._zone_changed,
    m.MissionEnded: LogChecker._mission_ended,
}
