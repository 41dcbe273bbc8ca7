"""A situation: the planning problem at one moment, as names and travel times without a grid.

There are five kinds of places. A *start* is where a robot is, or will be when its running action ends; a *target* is a
cluster of frontier cells; at a *meeting* point a carrier and a rover can dock; a *home* is where a carrier must end.
Travel times are per robot type, since each type has its own pose at a place. Running actions are not part of the
situation, only their ends: a docking rover counts as aboard, and its carrier is busy until the docking ends.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from marsupial.errors import Problem, SituationError
from marsupial.model.arguments import some_of
from marsupial.model.bounds import BOUNDS, Bound, field_problems, team_fault
from marsupial.model.robots import Role
from marsupial.model.scenario import ReturnGoal
from marsupial.model.seats import Seats, has_place, most_aboard, overload
from marsupial.wording import unknown

UNREACHABLE = -1  # entry of a travel table without a path

TravelTable = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningBattery:
    """The battery of a robot type, and how fast it is discharged and charged.

    Standing and driving discharge it; standing at a charging place charges it instead, and so does being aboard. A
    rover aboard gets its charge from the battery of its carrier, if it has one and does not stand at a charging place.
    Docking and undocking count as standing, for the rover and its carrier.
    """

    capacity_j: float
    """What it holds, in joules."""
    stand_w: float = 0.0
    """Power while standing, in watts."""
    drive_w: float = 0.0
    """Power in total while driving, in watts."""
    charge_w: float = 0.0
    """Power with which it is charged, in watts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningType:
    """The properties of a robot type that matter for planning; times in integer milliseconds."""

    name: str
    """Its name."""
    role: Role
    """Carrier or rover."""
    capacity: int = 0
    """How many rovers a carrier holds at most."""
    dock_ms: int = 0
    """How long a rover of this type takes to board, in ms."""
    undock_ms: int = 0
    """How long a rover of this type takes to be set down, in ms."""
    battery: PlanningBattery | None = None
    """Its battery; None has no limit."""
    seats: Seats = ()
    """Carriers: the most rovers of each type; empty: rovers of all types fit."""
    seats_as: str = ""
    """Rovers: the type whose seats they take, if not their own."""

    @property
    def seat(self) -> str:
        """The type whose seats a rover of this type takes."""
        return self.seats_as or self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotState:
    """Where and when a robot is free."""

    name: str
    """Its name."""
    type: str
    """The name of its robot type."""
    place: str | None = None
    """Name of its start, where it is or will be once it is free; None for a rover that is aboard."""
    carrier: str | None = None
    """Name of the carrier that it is aboard; None if it is on the ground."""
    free_at_ms: int = 0
    """When its running action ends, in ms from now; 0 is now. A rover aboard is not free before its carrier is."""
    home: str | None = None
    """Place where a carrier has to end if the goal is `return_home`."""
    charge_j: float | None = None
    """Charge of its battery at `free_at_ms`, in joules; None is full."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetInfo:
    """A target: a cluster of frontier cells to explore."""

    name: str
    """Its name, which is also that of a place."""
    explorers: frozenset[str]
    """The robot types that can explore it."""
    reveal_m2: float = 0.0
    """The area that it may reveal, in square metres."""
    priority: float = 1.0
    """How much more it is worth than others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SituationGoal(ReturnGoal):
    """The goal of a plan besides exploring all targets."""

    recover_rovers: bool = False
    """Whether all rovers have to end aboard."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Situation:
    """Robots, places, travel times and goal at one moment; raises SituationError with all problems found."""

    # names are unique over all robots and places
    types: tuple[PlanningType, ...]
    """The robot types."""
    robots: tuple[RobotState, ...]
    """Where and when each robot is free."""
    targets: tuple[TargetInfo, ...]
    """What is left to explore."""
    meetings: tuple[str, ...]
    """Names of the meeting points, where carriers set down and fetch rovers."""
    homes: tuple[str, ...] = ()
    """Names of the places where carriers have to end if the goal is `return_home`."""
    chargers: tuple[str, ...] = ()
    """Names of the places where batteries charge."""
    travel_ms: Mapping[str, TravelTable] = field(repr=False)
    """Travel times in ms: by robot type an int64 table (n, n) over `places`, row = from, column = to. Held read-only.

    `UNREACHABLE` (-1) without a path. A type that can't explore a target can't reach it either. See `travel`.
    """
    goal: SituationGoal = SituationGoal()
    """What a plan has to do besides exploring all targets."""

    def __post_init__(self) -> None:
        problems = list(_problems(self))
        if problems:
            raise SituationError(problems)
        tables = {}
        for kind in self.types:
            table = np.ascontiguousarray(self.travel_ms[kind.name], dtype=np.int64)
            # copy what the caller could still change
            if table is self.travel_ms[kind.name] and table.flags.writeable:
                table = table.copy()
            table.flags.writeable = False
            tables[kind.name] = table
        object.__setattr__(self, "travel_ms", tables)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Situation):
            return NotImplemented
        mine = (self.types, self.robots, self.targets, self.meetings, self.homes, self.chargers, self.goal)
        theirs = (other.types, other.robots, other.targets, other.meetings, other.homes, other.chargers, other.goal)
        return mine == theirs and all(
            np.array_equal(self.travel_ms[kind.name], other.travel_ms[kind.name]) for kind in self.types
        )

    __hash__ = None  # type: ignore[assignment]

    @cached_property
    def places(self) -> tuple[str, ...]:
        """All places in the order of the travel tables: starts (in robot order), targets, meetings, homes, chargers."""
        starts = tuple(robot.place for robot in self.robots if robot.place is not None)
        return starts + tuple(target.name for target in self.targets) + self.meetings + self.homes + self.chargers

    @cached_property
    def place_index(self) -> Mapping[str, int]:
        """Row and column of each place in the travel tables."""
        return {name: i for i, name in enumerate(self.places)}

    @cached_property
    def standing(self) -> Mapping[str, npt.NDArray[np.bool_]]:
        """Per robot type, bool (n,) over `places`: where its robots can stand, and so where rovers can be set down.

        They can stand where one is, where one can stay (`travel_ms` from the place to itself), or where a drive ends.
        """
        standing = {kind: (table != UNREACHABLE).any(axis=0) for kind, table in self.travel_ms.items()}
        for robot in self.robots:
            if robot.place is not None:
                standing[robot.type][self.place_index[robot.place]] = True
        return standing

    @cached_property
    def robot_by_name(self) -> Mapping[str, RobotState]:
        """Robots by name."""
        return {robot.name: robot for robot in self.robots}

    @cached_property
    def type_by_name(self) -> Mapping[str, PlanningType]:
        """Robot types by name."""
        return {kind.name: kind for kind in self.types}

    @cached_property
    def target_by_name(self) -> Mapping[str, TargetInfo]:
        """Targets by name."""
        return {target.name: target for target in self.targets}

    @cached_property
    def batteries(self) -> Mapping[str, PlanningBattery]:
        """The batteries by robot, of robots that have one."""
        kinds = ((robot.name, self.type_by_name[robot.type]) for robot in self.robots)
        return {name: kind.battery for name, kind in kinds if kind.battery is not None}

    @cached_property
    def charging(self) -> frozenset[str]:
        """Where batteries charge: the charging places, and the starts of robots that stand on one."""
        starts = ((robot.type, robot.place) for robot in self.robots if robot.place is not None)
        on = {place for kind, place in starts if any(self.travel(kind, place, name) == 0 for name in self.chargers)}
        return frozenset(on.union(self.chargers))

    def charge_j(self, robot: str) -> float:
        """Return the charge of a robot with a battery when it is free."""
        charge_j = self.robot_by_name[robot].charge_j
        return self.batteries[robot].capacity_j if charge_j is None else charge_j

    def without_batteries(self, *, chargers: bool = False) -> Situation:
        """Return the situation in which batteries have no limit, by default without charging places."""
        if not self.batteries and not self.chargers:
            return self
        bare = self.restricted(chargers=frozenset()) if self.chargers and not chargers else self
        types = tuple(replace(kind, battery=None) for kind in self.types)
        return replace(bare, types=types, robots=tuple(replace(robot, charge_j=None) for robot in self.robots))

    def type_of(self, robot: str) -> PlanningType:
        """Return the type of the robot with that name."""
        return self.type_by_name[self.robot_by_name[robot].type]

    def of_role(self, role: Role) -> tuple[RobotState, ...]:
        """Return the robots with a role, in order."""
        return tuple(robot for robot in self.robots if self.type_by_name[robot.type].role is role)

    @cached_property
    def has_seats(self) -> bool:
        """Whether types say which rovers fit on which carriers."""
        return any(kind.seats or kind.seats_as for kind in self.types)

    def most_aboard(self, carrier: str, rover: str) -> int:
        """Return how many rovers like `rover` a carrier can carry at most; 0 if it does not fit."""
        return most_aboard(self.type_of(carrier), self.type_of(rover).seat)

    def has_place(self, carrier: str, rover: str, aboard: Sequence[str]) -> bool:
        """Return whether a carrier with these rovers aboard has a place for `rover`."""
        kind = self.type_of(carrier)
        if not kind.seats:
            return len(aboard) < kind.capacity
        return has_place(kind, self.type_of(rover).seat, [self.type_of(other).seat for other in aboard])

    def travel(self, kind: str, origin: str, goal: str) -> int | None:
        """Return the travel time in ms of robot type `kind`, or None without a path."""
        value = int(self.travel_ms[kind][self.place_index[origin], self.place_index[goal]])
        return None if value == UNREACHABLE else value

    def can_stand(self, kind: str, place: str) -> bool:
        """Return whether robots of type `kind` can stand at a place."""
        return bool(self.standing[kind][self.place_index[place]])

    def restricted(
        self,
        *,
        robots: Collection[str] | None = None,
        targets: Collection[str] | None = None,
        meetings: Collection[str] | None = None,
        chargers: Collection[str] | None = None,
    ) -> Situation:
        """Return the situation with only the named robots, targets, meetings and charging places (None keeps all).

        A rover that is aboard needs its carrier. Homes of removed carriers are removed as well.
        Raise a `UsageError` for anything but a set, list or tuple of names that the situation has.
        """
        robots = some_of("robots", robots, self.robot_by_name)
        targets = some_of("targets", targets, self.target_by_name)
        meetings = some_of("meetings", meetings, self.meetings)
        chargers = some_of("chargers", chargers, self.chargers)
        kept = tuple(r for r in self.robots if robots is None or r.name in robots)
        kept_targets = tuple(t for t in self.targets if targets is None or t.name in targets)
        kept_meetings = tuple(m for m in self.meetings if meetings is None or m in meetings)
        homes = tuple(h for h in self.homes if any(r.home == h for r in kept))
        kept_chargers = tuple(c for c in self.chargers if chargers is None or c in chargers)
        names = {*(r.place for r in kept), *(t.name for t in kept_targets), *kept_meetings, *homes, *kept_chargers}
        rows = np.array([i for i, name in enumerate(self.places) if name in names], dtype=np.intp)
        tables = {name: table[np.ix_(rows, rows)] for name, table in self.travel_ms.items()}
        for name, table in tables.items():
            # destinations of drives from removed places remain places to stand
            stands = np.diagonal(table) != UNREACHABLE
            np.fill_diagonal(table, np.where(self.standing[name][rows] & ~stands, 0, np.diagonal(table)))
        return replace(
            self,
            robots=kept,
            targets=kept_targets,
            meetings=kept_meetings,
            homes=homes,
            chargers=kept_chargers,
            travel_ms=tables,
        )


def _problems(situation: Situation) -> list[Problem]:
    # the other checks would take long with a team that is far too large
    if fault := team_fault(len(situation.robots)):
        return [Problem("robots", fault)]
    roles = {kind.name: kind.role for kind in situation.types}
    problems = _repeated("types", [kind.name for kind in situation.types]) + _robot_problems(situation, roles)
    for i, target in enumerate(situation.targets):
        problems += field_problems(target, f"targets[{i}].", "priority")
        # without a suggestion: that takes milliseconds, and there may be thousands of targets
        strange = sorted(target.explorers - roles.keys())
        if strange:
            problems.append(Problem(f"targets[{i}].explorers", f"unknown robot type {strange[0]!r}"))
    problems += _repeated("places", [*(robot.name for robot in situation.robots), *situation.places])
    # the row and column of a place follow from the order of `places`, so sizes must match exactly
    shape = (len(situation.places), len(situation.places))
    for i, kind in enumerate(situation.types):
        table = situation.travel_ms.get(kind.name)
        if table is None:
            problems.append(Problem(f"travel_ms.{kind.name}", "missing"))
        elif np.shape(table) != shape:
            problems.append(Problem(f"travel_ms.{kind.name}", f"must have shape {shape}, got {np.shape(table)}"))
        elif table.size and int(np.min(table)) < UNREACHABLE:
            problems.append(Problem(f"travel_ms.{kind.name}", "must hold times of 0 ms or more, or -1"))
        problems += field_problems(kind, f"types[{i}].", "capacity", "dock_ms", "undock_ms")
        if kind.battery is not None:
            powers = "stand_w", "drive_w", "charge_w"
            problems += field_problems(kind.battery, f"types[{i}].battery.", "capacity_j", *powers)
        problems += _seat_problems(f"types[{i}]", kind, roles)
    return problems


def _repeated(path: str, names: list[str]) -> list[Problem]:
    return [Problem(path, f"name {n!r} is used twice") for n, times in sorted(Counter(names).items()) if times > 1]


def _charge_fault(situation: Situation, robot: RobotState) -> str | None:
    battery = {kind.name: kind.battery for kind in situation.types}.get(robot.type)
    if battery is None:
        return f"type {robot.type} has no battery"
    return Bound(0, battery.capacity_j, "J").fault(robot.charge_j or 0.0)


def _robot_problems(situation: Situation, roles: Mapping[str, Role]) -> list[Problem]:
    problems: list[Problem] = []
    carriers = {r.name for r in situation.robots if roles.get(r.type) is Role.CARRIER}
    seats = {kind.name: kind.seat for kind in situation.types}
    load: dict[str, list[str]] = {}
    for i, robot in enumerate(situation.robots):
        path = f"robots[{i}]"
        if robot.type not in roles:
            problems.append(Problem(f"{path}.type", unknown("robot type", robot.type, roles)))
        if (robot.place is None) == (robot.carrier is None):
            problems.append(Problem(path, f"{robot.name} must be either at a place or on a carrier"))
        if robot.carrier is not None and (robot.name in carriers or robot.carrier not in carriers):
            problems.append(Problem(f"{path}.carrier", f"{robot.name} can't be carried by {robot.carrier!r}"))
        elif robot.carrier is not None:
            load.setdefault(robot.carrier, []).append(seats.get(robot.type, robot.type))
        problems += field_problems(robot, f"{path}.", "free_at_ms")
        if robot.home is not None and robot.home not in situation.homes:
            problems.append(Problem(f"{path}.home", unknown("home", robot.home, situation.homes)))
        if robot.charge_j is not None and (fault := _charge_fault(situation, robot)):
            problems.append(Problem(f"{path}.charge_j", fault))
    kinds = {kind.name: kind for kind in situation.types}
    for i, robot in enumerate(situation.robots):
        kind = kinds.get(robot.type)
        if kind is not None and robot.name in load and (fault := overload(kind, load[robot.name])):
            problems.append(Problem(f"robots[{i}]", f"{robot.name} {fault}"))
    return problems


def _seat_problems(path: str, kind: PlanningType, roles: Mapping[str, Role]) -> Iterator[Problem]:
    yield from _repeated(f"{path}.seats", [rover for rover, _ in kind.seats])
    for rover, number in kind.seats:
        if fault := _rover_fault(rover, roles) or BOUNDS["capacity"].fault(number):
            yield Problem(f"{path}.seats.{rover}", fault)
    if kind.seats and kind.role is Role.ROVER:
        yield Problem(f"{path}.seats", "only carriers have it")
    if kind.seats_as and kind.role is Role.CARRIER:
        yield Problem(f"{path}.seats_as", "only rovers have it")
    elif kind.seats_as and (fault := _rover_fault(kind.seats_as, roles)):
        yield Problem(f"{path}.seats_as", fault)


def _rover_fault(kind: str, roles: Mapping[str, Role]) -> str | None:
    """Return why a name is not that of a rover type, or None."""
    if kind not in roles:
        return unknown("robot type", kind, roles)
    return None if roles[kind] is Role.ROVER else f"{kind!r} is a carrier, not a rover"
