"""Batteries in the simulator: they run down on the ground; a robot with an empty one fails.

They charge aboard and at charging places (`marsupial.model.charges`). So that a robot fails at the right time even if
nothing else happens to it, an event looks at its battery when it may be empty at the earliest.
"""

from dataclasses import dataclass
from typing import Any

from marsupial.model.charges import BatteryUse, TeamCharges
from marsupial.sim.motion import Motion, RobotActivity, Rule, SimulatedRobot

_LEAST_MS = 100  # least time between two looks

_ROUNDING = 1e-9  # of shares of charge

_DOCKINGS = (RobotActivity.DOCKING, RobotActivity.UNDOCKING)


@dataclass(frozen=True, slots=True)
class BatteryLook:
    """The battery of a robot may be empty now."""

    robot: SimulatedRobot


class Batteries(Rule):
    """Gives robots the batteries of their types, full at first."""

    def __init__(self, motion: Motion) -> None:
        self._motion = motion
        self._charges = TeamCharges({name: robot.kind for name, robot in motion.team.items()}, self._use, self._aboard)
        self._looks: dict[str, int] = {}  # when to look at each battery next
        for robot in motion.team.values():
            self._watch(robot)

    def charge(self, robot: SimulatedRobot) -> float | None:
        """Return the share of its battery's capacity that a robot has now; None without a battery."""
        return (
            max(0.0, self._charges.share(robot.name, self._motion.now_ms)) if robot.kind.battery is not None else None
        )

    def report(self, robot: SimulatedRobot, fields: dict[str, Any]) -> None:
        if robot.kind.battery is not None:
            fields["charge"] = self._charges.reported(robot.name, self._motion.now_ms)

    def before_change(self, robot: SimulatedRobot) -> None:
        self._charges.settle(self._motion.now_ms, robot.name)

    def after_change(self, robot: SimulatedRobot) -> None:
        self._charges.resume(self._motion.now_ms, robot.name)
        self._watch(robot)

    def on_time(self, event: object) -> None:
        if isinstance(event, BatteryLook):
            current = self._looks[event.robot.name] == self._motion.now_ms
            if current and not self._empty(event.robot):
                self._watch(event.robot)

    def on_step(self, robot: SimulatedRobot, *, ended: bool) -> bool:
        return not self._empty(robot) and ended

    def _watch(self, robot: SimulatedRobot) -> None:
        """Look at the battery of a robot when it may be empty at the earliest."""
        if robot.kind.battery is None or robot.lost or self._use(robot.name).charging:
            return
        now_ms = self._motion.now_ms
        power_w = robot.kind.power_w(driving=robot.activity is RobotActivity.DRIVING, speed=robot.speed)
        power_w += self._charges.given_w(robot.name, now_ms)
        if not power_w:
            return
        left_j = self._charges.share(robot.name, now_ms) * robot.kind.battery.capacity_j
        at_ms = now_ms + max(_LEAST_MS, int(1000 * left_j / power_w))
        if not now_ms < self._looks.get(robot.name, 0) <= at_ms:
            self._looks[robot.name] = at_ms
            self._motion.at(at_ms, BatteryLook(robot))

    def _empty(self, robot: SimulatedRobot) -> bool:
        """Return whether the battery of a robot on the ground is empty; then the robot fails."""
        if robot.kind.battery is None or self._use(robot.name).charging:
            return False
        empty = self._charges.share(robot.name, self._motion.now_ms) < -_ROUNDING
        if empty:
            self._motion.fail(robot, "has an empty battery")
        return empty

    def _aboard(self, name: str) -> str | None:
        """Return the carrier that a robot is aboard; None while it docks."""
        robot = self._motion.team[name]
        return None if robot.activity in _DOCKINGS else robot.carrier

    def _use(self, name: str) -> BatteryUse:
        """Return what a robot does with its battery."""
        robot, grid = self._motion.team[name], self._motion.grid
        driving = robot.activity is RobotActivity.DRIVING
        step_ms, step_m = 0, 0.0
        if driving and robot.step and robot.times_ms[robot.step] > self._motion.now_ms:
            before, there = robot.route[robot.step - 1 : robot.step + 1]
            cells = 1.0 if before.x == there.x or before.y == there.y else robot.kind.diagonal
            step_m = cells * grid.resolution_m
            step_ms = int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
        return BatteryUse(
            driving_ms=robot.driving_ms,
            distance_m=robot.distance_cells * grid.resolution_m,
            charging=self._aboard(name) is not None or (robot.cell in grid.chargers and not driving),
            lost=robot.lost,
            free_at_ms=int(robot.times_ms[robot.step]) if driving else robot.free_at_ms,
            step_ms=step_ms,
            step_m=step_m,
        )
