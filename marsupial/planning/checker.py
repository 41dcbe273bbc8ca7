"""Check whether a plan is feasible in a situation and reaches its goal, independently of any planner.

Actions are checked in order of start. The conditions of an action depend on its own robots only: where they are, on
which carrier, since when they are free. A robot takes part in one action at a time, so an action that depends on
another's effects can only begin after its end. Therefore effects are applied as soon as an action is accepted. For the
capacity and the seats of a carrier this means that docks count from their start, and undocks until their end.

A plan must not run a battery down, nor strand a robot: at its end every rover on the ground can still get to a charging
place or a carrier before its battery is empty, if each has the carriers for itself, and every carrier to a charging
place, if there are any. A robot that could not be saved when the plan begins is not the plan's fault.

The checker deliberately applies effects itself and shares no rule with the code that makes plans
(`marsupial.model.team`), so that it also finds mistakes of that code.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import accumulate

from marsupial.model import EPSILON_MS, Action, ActionName, Plan, PlanningBattery, Role, Situation


class ViolationKind(StrEnum):
    """What is wrong with a plan."""

    MALFORMED = "malformed"  # a move or explore without origin or with a carrier, a dock or undock the other way round
    UNKNOWN_NAME = "unknown_name"  # no such robot or place
    WRONG_ROLE = "wrong_role"  # only a rover docks and undocks, only on and from a carrier
    OUT_OF_ORDER = "out_of_order"  # listed after an action that starts later
    TOO_EARLY = "too_early"  # before the plan begins, or before the robot's running action ends
    OVERLAP = "overlap"  # less than EPSILON_MS after the end of the robot's previous action
    WRONG_PLACE = "wrong_place"  # a move to no meeting or home, an explore of no target, a dock at no meeting
    CARRIED = "carried"  # a carried rover can't move, explore or dock
    ELSEWHERE = "elsewhere"  # the robot is not at the place where the action begins
    NOT_ABOARD = "not_aboard"  # an undock of a rover that is not on that carrier
    CANNOT_EXPLORE = "cannot_explore"  # a target that the robot's type can't explore
    NO_PATH = "no_path"  # no path for the robot's type
    WRONG_DURATION = "wrong_duration"  # not exactly what the situation says
    NO_CAPACITY = "no_capacity"  # a dock on a full carrier
    NO_SEAT = "no_seat"  # a dock on a carrier that has no seat, or no free one, for rovers of that type
    NO_ROOM = "no_room"  # an undock where the rover's type can't stand
    BATTERY_EMPTY = "battery_empty"  # an action that the charge of a battery does not suffice for
    TARGET_UNEXPLORED = "target_unexplored"  # goal
    ROVER_NOT_ABOARD = "rover_not_aboard"  # goal
    CARRIER_NOT_HOME = "carrier_not_home"  # goal
    STRANDED = "stranded"  # a robot whose battery will be empty before it can charge


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """What is wrong, when, and in which action; `action` is None where the goal is not reached at the end."""

    kind: ViolationKind
    time_ms: int
    action: Action | None
    message: str

    def __str__(self) -> str:
        where = "at the end" if self.action is None else str(self.action)
        return f"{self.time_ms / 1000:.3f} s, {where}: {self.message}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Whether a plan is valid, and if not the first violation in time."""

    valid: bool
    violation: Violation | None
    makespan_ms: int


def check(situation: Situation, plan: Plan, *, targets: frozenset[str] | None = None) -> Verdict:
    """Return whether `plan` is feasible, explores `targets` (None: all) and reaches the other goals.

    The violation is the first in time; among actions that start together, the first in the order of the plan.
    """
    violation = next(_violations(situation, plan, targets), None)
    return Verdict(valid=violation is None, violation=violation, makespan_ms=plan.makespan_ms)


def _violations(situation: Situation, plan: Plan, targets: frozenset[str] | None) -> Iterator[Violation]:
    """Yield the violations in order of time; only the first one is meaningful."""
    latest = accumulate((action.start_ms for action in plan.actions), max)
    late = [action.start_ms < start for action, start in zip(plan.actions, latest, strict=True)]
    world = _World(situation)
    # Sorted, but stable: of actions that start together, the plan's order decides.
    for i in sorted(range(len(late)), key=lambda i: plan.actions[i].start_ms):
        action = plan.actions[i]
        fault = (ViolationKind.OUT_OF_ORDER, "listed after an action that starts later") if late[i] else None
        fault = fault or world.fault(action)
        if fault is not None:
            yield Violation(kind=fault[0], time_ms=action.start_ms, action=action, message=fault[1])
        world.apply(action)
    wanted = (target.name for target in situation.targets) if targets is None else sorted(targets)
    for kind, message in (*world.missing(tuple(wanted)), *world.stranded()):
        yield Violation(kind=kind, time_ms=plan.makespan_ms, action=None, message=message)


Breach = tuple[ViolationKind, str]

_TOLERANCE_J = 1e-6  # of the rounding of sums


class _World:
    """The position of each robot after the actions so far: `at` a place or `on` a carrier, free from `free_ms`."""

    def __init__(self, situation: Situation) -> None:
        self.situation, robots, batteries = situation, situation.robots, situation.batteries
        self.at = {robot.name: robot.place for robot in robots}
        self.on = {robot.name: robot.carrier for robot in robots}
        # a rover aboard is free when its carrier is
        free = {robot.name: robot.free_at_ms for robot in robots}
        self.free_ms = {robot.name: free[robot.carrier or robot.name] for robot in robots}
        self.busy: set[str] = set()
        self.explored: set[str] = set()
        self.rovers = {robot.name for robot in situation.of_role(Role.ROVER)} if batteries else frozenset()
        # the charge of batteries in J, and since when the robot stands or is aboard
        self.charge = {name: (situation.charge_j(name), situation.robot_by_name[name].free_at_ms) for name in batteries}
        self.hopeless = set(self._unsaved())

    def fault(self, action: Action) -> Breach | None:
        names = self._names(action) or self._role(action) or self._time(action)
        return names or _CHECKS[action.name](self, action) or (self._discharge(action) if self.charge else None)

    def apply(self, action: Action) -> None:
        if self.charge:
            self.charge |= self._charges_after(action)
        for robot in action.robots:
            self.free_ms[robot] = action.end_ms + EPSILON_MS
            self.busy.add(robot)
        docked = action.name is ActionName.DOCK
        self.at[action.robot] = None if docked else action.place
        self.on[action.robot] = action.carrier if docked else None
        if action.name is ActionName.EXPLORE:
            self.explored.add(action.place)

    def missing(self, targets: tuple[str, ...]) -> Iterator[Breach]:
        for target in targets:
            if target not in self.explored:
                yield ViolationKind.TARGET_UNEXPLORED, f"{target} has not been explored"
        goal = self.situation.goal
        if goal.aboard:
            for rover in self.situation.of_role(Role.ROVER):
                if self.on[rover.name] is None:
                    yield ViolationKind.ROVER_NOT_ABOARD, f"{rover.name} is not aboard a carrier"
        if goal.return_home:
            for robot in self.situation.of_role(Role.CARRIER):
                if robot.home is not None and self.at[robot.name] != robot.home:
                    yield ViolationKind.CARRIER_NOT_HOME, f"{robot.name} is not at its home {robot.home}"

    def stranded(self) -> Iterator[Breach]:
        for robot in self._unsaved():
            if robot not in self.hopeless:
                where = "aboard a carrier or at a charging place" if robot in self.rovers else "at a charging place"
                yield ViolationKind.STRANDED, f"the battery of {robot} will be empty before it is {where}"

    def _unsaved(self) -> Iterator[str]:
        """Yield the robots whose charge does not suffice to get to a charging place or aboard a carrier from now on."""
        for robot, (charge_j, since_ms) in self.charge.items():
            if self.on[robot] is not None or self.at[robot] in self.situation.charging:
                continue
            needed = [*self._ways_j(robot, since_ms)]
            needed += self._dockings_j(robot, since_ms) if robot in self.rovers else ()
            if (needed or robot in self.rovers) and charge_j - min(needed, default=math.inf) < -_TOLERANCE_J:
                yield robot

    def _dockings_j(self, rover: str, since_ms: int) -> Iterator[float]:
        """Yield the energy that a rover needs from a time on until it is aboard, per carrier and meeting point."""
        situation, battery = self.situation, self.situation.batteries[rover]
        kind, here_ms = situation.type_of(rover), self._arrivals(rover, situation.meetings)
        for carrier in situation.of_role(Role.CARRIER):
            if self._most(carrier.name, rover) == 0:
                continue
            for meeting, carrier_ms in self._arrivals(carrier.name, situation.meetings).items():
                if meeting in here_ms:
                    ends_ms = max(carrier_ms, here_ms[meeting]) + max(1, kind.dock_ms)
                    driving_ms = here_ms[meeting] - self.free_ms[rover]
                    yield self._used_j(battery, ends_ms - since_ms, driving_ms)

    def _ways_j(self, robot: str, since_ms: int) -> Iterator[float]:
        """Yield the energy that a robot needs from a time on until it is at a charging place, for each."""
        battery = self.situation.batteries[robot]
        for there_ms in self._arrivals(robot, self.situation.chargers).values():
            yield self._used_j(battery, there_ms - since_ms, there_ms - self.free_ms[robot])

    def _arrivals(self, robot: str, places: Iterable[str]) -> dict[str, int]:
        """Return when a robot on the ground could be at places if it sets off as soon as it is free."""
        at, kind = self.at[robot], self.situation.robot_by_name[robot].type
        ways = {p: 0 if p == at else self.situation.travel(kind, at, p) for p in places} if at is not None else {}
        return {place: self.free_ms[robot] + ms for place, ms in ways.items() if ms is not None}

    @staticmethod
    def _used_j(battery: PlanningBattery, total_ms: int, driving_ms: int) -> float:
        return (battery.stand_w * (total_ms - driving_ms) + battery.drive_w * driving_ms) / 1000

    def _charges_after(self, action: Action) -> dict[str, tuple[float, int]]:
        """Return the charges that an action changes, and when they have these values.

        A charge changes in other ways only from the start of an action or to its end: while its robot drives, is set
        down, or gets aboard, and that of a carrier as its cargo changes.
        """
        after: dict[str, tuple[float, int]] = {}
        drives = action.carrier is None
        vehicle = action.carrier or action.robot
        given_j = [0.0, 0.0]  # what the vehicle gives to its rovers before and during the action
        for rover in (name for name, on in self.on.items() if on == vehicle and name in self.charge):
            for i, t_ms in enumerate((action.start_ms, action.end_ms)):
                level_j, since_ms = after.get(rover, self.charge[rover])
                if i and rover == action.robot:
                    continue  # it is being set down
                battery = self.situation.batteries[rover]
                gain_j = min(battery.capacity_j - level_j, battery.charge_w * (t_ms - since_ms) / 1000)
                given_j[i] += gain_j
                after[rover] = level_j + gain_j, t_ms
        for robot in action.robots:
            if robot not in self.charge:
                continue
            battery, (level_j, since_ms) = self.situation.batteries[robot], after.get(robot, self.charge[robot])
            before_ms = action.start_ms - since_ms
            if self.on[robot] is None and self.at[robot] in self.situation.charging:
                level_j = min(battery.capacity_j, level_j + battery.charge_w * before_ms / 1000)
            elif self.on[robot] is None:
                level_j -= battery.stand_w * before_ms / 1000 + given_j[0] * (robot == vehicle)
            level_j -= self._used_j(battery, action.duration_ms, action.duration_ms * drives)
            after[robot] = level_j - given_j[1] * (robot == vehicle), action.end_ms
        return after

    def _discharge(self, action: Action) -> Breach | None:
        for robot, (left_j, _) in self._charges_after(action).items():
            if left_j < -_TOLERANCE_J:
                return ViolationKind.BATTERY_EMPTY, f"{robot} has {-left_j:.3f} J too little"
        return None

    def _names(self, action: Action) -> Breach | None:
        drives = action.name in (ActionName.MOVE, ActionName.EXPLORE)
        if drives == (action.origin is None) or drives == (action.carrier is not None):
            needs = "an origin and no carrier" if drives else "a carrier and no origin"
            return ViolationKind.MALFORMED, f"{action.name} needs {needs}"
        for robot in action.robots:
            if robot not in self.situation.robot_by_name:
                return ViolationKind.UNKNOWN_NAME, f"there is no robot {robot!r}"
        for place in (action.origin, action.place):
            if place is not None and place not in self.situation.place_index:
                return ViolationKind.UNKNOWN_NAME, f"there is no place {place!r}"
        return None

    def _role(self, action: Action) -> Breach | None:
        if action.carrier is None:
            return None
        if self.situation.type_of(action.robot).role is not Role.ROVER:
            return ViolationKind.WRONG_ROLE, f"{action.robot} is not a rover"
        if self.situation.type_of(action.carrier).role is not Role.CARRIER:
            return ViolationKind.WRONG_ROLE, f"{action.carrier} is not a carrier"
        return None

    def _time(self, action: Action) -> Breach | None:
        if action.start_ms < 0:
            return ViolationKind.TOO_EARLY, "starts before the plan begins"
        for robot in action.robots:
            free = self.free_ms[robot]
            if action.start_ms < free and robot in self.busy:
                why = f"(its last action, then {EPSILON_MS} ms)"
                return ViolationKind.OVERLAP, f"{robot} is free from {free} ms only {why}"
            if action.start_ms < free:
                return ViolationKind.TOO_EARLY, f"{robot} is busy until {free} ms"
        return None

    def _drive(self, action: Action) -> Breach | None:
        robot, origin = action.robot, action.origin
        if self.on[robot] is not None:
            return ViolationKind.CARRIED, f"{robot} is aboard {self.on[robot]}"
        if self.at[robot] != origin or origin is None:
            return ViolationKind.ELSEWHERE, f"{robot} is at {self.at[robot]}, not at {origin}"
        travel = self.situation.travel(self.situation.robot_by_name[robot].type, origin, action.place)
        if travel is None:
            return ViolationKind.NO_PATH, f"{robot} has no path from {origin} to {action.place}"
        return _duration(action, travel)

    def _move(self, action: Action) -> Breach | None:
        situation = self.situation
        if action.place not in situation.meetings + situation.homes + situation.chargers:
            return ViolationKind.WRONG_PLACE, f"{action.place} is neither a meeting point nor a home"
        return self._drive(action)

    def _explore(self, action: Action) -> Breach | None:
        target = self.situation.target_by_name.get(action.place)
        if target is None:
            return ViolationKind.WRONG_PLACE, f"{action.place} is not a target"
        kind = self.situation.robot_by_name[action.robot].type
        if kind not in target.explorers:
            return ViolationKind.CANNOT_EXPLORE, f"type {kind} can't explore {target.name}"
        return self._drive(action)

    def _dock(self, action: Action) -> Breach | None:
        if self.on[action.robot] is not None:
            return ViolationKind.CARRIED, f"{action.robot} is aboard {self.on[action.robot]}"
        fault = self._meet(action, action.robots)
        if fault is not None:
            return fault
        carrier = action.robots[1]
        aboard, kind = [rover for rover, on in self.on.items() if on == carrier], self.situation.type_of(carrier)
        if len(aboard) + 1 > kind.capacity:
            return ViolationKind.NO_CAPACITY, f"{carrier} carries {len(aboard)} of {kind.capacity}"
        if kind.seats:
            group, most = self._group(action.robot), self._most(carrier, action.robot)
            alike = sum(self._group(rover) == group for rover in aboard)
            if alike + 1 > most:
                return ViolationKind.NO_SEAT, f"{carrier} carries {alike} of type {group}, with {most} seats for them"
        return _duration(action, self.situation.type_of(action.robot).dock_ms)

    def _group(self, rover: str) -> str:
        """Return the type whose seats a rover takes."""
        kind = self.situation.type_of(rover)
        return kind.seats_as or kind.name

    def _most(self, carrier: str, rover: str) -> int:
        """Return how many rovers with the seats of this one a carrier can carry at most."""
        kind, group = self.situation.type_of(carrier), self._group(rover)
        seats = [number for name, number in kind.seats if name == group]
        return min(kind.capacity, sum(seats)) if kind.seats else kind.capacity

    def _undock(self, action: Action) -> Breach | None:
        if self.on[action.robot] != action.carrier:
            return ViolationKind.NOT_ABOARD, f"{action.robot} is not aboard {action.carrier}"
        fault = self._meet(action, action.robots[1:])
        if fault is not None:
            return fault
        # A robot that drove to a meeting point can stand there. A rover carried there may be too wide for it.
        kind = self.situation.type_of(action.robot)
        if not self.situation.can_stand(kind.name, action.place):
            return ViolationKind.NO_ROOM, f"type {kind.name} can't stand at {action.place}"
        return _duration(action, kind.undock_ms)

    def _meet(self, action: Action, robots: tuple[str, ...]) -> Breach | None:
        if action.place not in self.situation.meetings:
            return ViolationKind.WRONG_PLACE, f"{action.place} is not a meeting point"
        for robot in robots:
            if self.at[robot] != action.place:
                return ViolationKind.ELSEWHERE, f"{robot} is at {self.at[robot]}, not at {action.place}"
        return None


_CHECKS: Mapping[ActionName, Callable[[_World, Action], Breach | None]] = {
    ActionName.MOVE: _World._move,
    ActionName.EXPLORE: _World._explore,
    ActionName.DOCK: _World._dock,
    ActionName.UNDOCK: _World._undock,
}


def _duration(action: Action, expected_ms: int) -> Breach | None:
    expected_ms = max(1, expected_ms)
    if action.duration_ms == expected_ms:
        return None
    return ViolationKind.WRONG_DURATION, f"takes {expected_ms} ms, not {action.duration_ms} ms"
