"""The charges of batteries along a plan: what drives, dockings and waits take, and what charging gives.

`marsupial.model.situation.PlanningBattery` has the rules. A charge changes at a constant rate between the actions of
its robot and, for a carrier, those of its cargo: so it only has to be computed at their starts and ends.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from marsupial.model import Action, ActionName, Plan, Situation

_ROUNDING = 1e-9  # of sums of shares


@dataclass(slots=True)
class Charges:
    """The charge of each battery in J at a time in ms, after the actions so far."""

    situation: Situation
    level_j: dict[str, float]
    since_ms: dict[str, int]
    least_j: dict[str, float]  # the least charge that each has had on the ground
    at: dict[str, str | None]
    on: dict[str, str | None]
    _seen: int = field(default=0)

    @classmethod
    def of(cls, situation: Situation) -> Charges:
        """Return the charges before any action."""
        robots = situation.robot_by_name
        levels = {name: situation.charge_j(name) for name in situation.batteries}
        return cls(
            situation,
            levels,
            {name: robots[name].free_at_ms for name in levels},
            {name: math.inf if robots[name].carrier else level for name, level in levels.items()},
            {name: robot.place for name, robot in robots.items()},
            {name: robot.carrier for name, robot in robots.items()},
        )

    def copy(self) -> Charges:
        """Return a copy that can be continued differently."""
        levels, since_ms, least_j = dict(self.level_j), dict(self.since_ms), dict(self.least_j)
        return Charges(self.situation, levels, since_ms, least_j, dict(self.at), dict(self.on), self._seen)

    def charging(self, robot: str) -> bool:
        """Return whether a robot's battery is charged where it is."""
        return self.on[robot] is not None or self.at[robot] in self.situation.charging

    def charged_at(self, robot: str, t_ms: int) -> float:
        """Return the charge of a robot that is charging, at a time after the actions so far."""
        battery, past_s = self.situation.batteries[robot], (t_ms - self.since_ms[robot]) / 1000
        return min(battery.capacity_j, self.level_j[robot] + battery.charge_w * past_s)

    def charged_ms(self, robot: str, wanted_j: float) -> int | None:
        """Return when a robot that is charging has a charge, at most a full battery; None if never."""
        battery = self.situation.batteries[robot]
        lacking_j = min(wanted_j, battery.capacity_j) - self.level_j[robot]
        if lacking_j <= 0:
            return self.since_ms[robot]
        return self.since_ms[robot] + math.ceil(1000 * lacking_j / battery.charge_w) if battery.charge_w else None

    def after_drive(self, robot: str, driving_ms: int, t_ms: int) -> float:
        """Return the charge of a robot on the ground at a time, after a drive and standing otherwise."""
        battery, past_ms = self.situation.batteries[robot], t_ms - self.since_ms[robot]
        used_j = battery.stand_w * (past_ms - driving_ms) + battery.drive_w * driving_ms
        return self.level_j[robot] - used_j / 1000

    def lasting_s(self, robot: str) -> float:
        """Return how long the charge of a robot lasts if it stands."""
        stand_w = self.situation.batteries[robot].stand_w
        return self.level_j[robot] / stand_w if stand_w else math.inf

    def catch_up(self, actions: list[Action]) -> None:
        """Add the actions of a list that are new since the last time."""
        for action in actions[self._seen :]:
            self.add(action)
        self._seen = len(actions)

    def add(self, action: Action) -> None:
        """Add an action, in order for each of its robots."""
        drives = action.carrier is None
        for robot in action.robots:
            self._pass(robot, action.start_ms)
        if drives or action.name is ActionName.UNDOCK:
            self.at[action.robot], self.on[action.robot] = None if drives else action.place, None
        for robot in action.robots:
            self._pass(robot, action.end_ms, drives=drives)
        docked = action.name is ActionName.DOCK
        self.at[action.robot] = None if docked else action.place
        self.on[action.robot] = action.carrier if docked else None

    def _pass(self, robot: str, t_ms: int, *, drives: bool = False) -> None:
        """Let time pass for a robot and its cargo."""
        given_j = sum(self._charge(rover, t_ms) for rover, on in self.on.items() if on == robot)
        if robot not in self.level_j or self.on[robot] is not None:
            return
        if self.charging(robot):
            self._charge(robot, t_ms)
            return
        battery, past_s = self.situation.batteries[robot], (t_ms - self.since_ms[robot]) / 1000
        self.level_j[robot] -= (battery.drive_w if drives else battery.stand_w) * past_s + given_j
        self.since_ms[robot] = t_ms
        self.least_j[robot] = min(self.least_j[robot], self.level_j[robot])

    def _charge(self, robot: str, t_ms: int) -> float:
        """Let time pass for a robot that is charging; return what it gains."""
        if robot not in self.level_j:
            return 0.0
        level_j = self.charged_at(robot, t_ms)
        gain_j = level_j - self.level_j[robot]
        self.level_j[robot], self.since_ms[robot] = level_j, t_ms
        return gain_j


@dataclass(frozen=True, slots=True)
class Charged:
    """A share of its battery's capacity that a robot waits for, and how much it gains in a millisecond."""

    robot: str
    share: float
    per_ms: float

    def after_ms(self, share: float | None) -> int:
        """Return how long a robot with this share has to wait."""
        lacking = 0.0 if share is None else self.share - share
        return math.ceil(lacking / self.per_ms) if lacking > _ROUNDING and self.per_ms else 0


ChargedFirst = Mapping[Action, tuple[Charged, ...]]
"""By action, what its robots that are charging wait for."""


def charged_first(situation: Situation, plan: Plan) -> ChargedFirst:
    """Return what the actions of a plan that end the charging of robots count on: the charges that these have then."""
    found: dict[Action, tuple[Charged, ...]] = {}
    if not situation.batteries:
        return found
    charges = Charges.of(situation)
    for action in plan.actions:
        charging = [robot for robot in action.robots if robot in charges.level_j and charges.charging(robot)]
        if charging:
            found[action] = tuple(_charged(charges, robot, action.start_ms) for robot in charging)
        charges.add(action)
    return found


def _charged(charges: Charges, robot: str, t_ms: int) -> Charged:
    battery = charges.situation.batteries[robot]
    share = charges.charged_at(robot, t_ms) / battery.capacity_j
    return Charged(robot, share, battery.charge_w / battery.capacity_j / 1000)
