"""Batteries in the simulator: they run down on the ground; a robot with an empty one fails.

They charge aboard and at charging places (`marsupial.model.charges`). So that a robot fails at the right time even if
nothing else happens to it, an event looks at its battery when it may be empty at the earliest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from marsupial.model import Cell, RobotReport, RobotType
from marsupial.model.charges import BatteryUse, TeamCharges
from marsupial.sim.faults import FaultyWorld
from marsupial.sim.world import RobotActivity, SimulatedRobot

_LOOK = -1  # event number of looks at a battery

_LEAST_MS = 100  # least time between two looks

_ROUNDING = 1e-9  # of shares of charge

_DOCKINGS = (RobotActivity.DOCKING, RobotActivity.UNDOCKING)


class BatteryWorld(FaultyWorld):
    """A simulated `World` in which robots have the batteries of their types, full at first."""

    def _set_up(self, kinds: Mapping[str, RobotType]) -> None:
        super()._set_up(kinds)
        self._charges = TeamCharges({name: robot.kind for name, robot in self._robots.items()}, self._use, self._aboard)
        self._looks: dict[str, int] = {}  # when to look at each battery next
        for name in self._charges.robots:
            self._watch(self._robots[name])

    def dock(self, rover: str, carrier: str) -> None:
        self._charges.settle(self.now_ms, rover, carrier)
        super().dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._charges.settle(self.now_ms, rover, carrier)
        super().undock(rover, carrier, cell)
        self._watch(self._robots[rover])

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self._charges.settle(self.now_ms, robot)
        super().drive(robot, route)
        self._watch(self._robots[robot])

    def charge(self, robot: str) -> float | None:
        """Return the share of its battery's capacity that a robot has now; None without a battery."""
        has_battery = self._robots[robot].kind.battery is not None
        return max(0.0, self._charges.share(robot, self.now_ms)) if has_battery else None

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        if robot.kind.battery is None:
            return report
        return replace(report, charge=self._charges.reported(robot.name, self.now_ms))

    def _settle_charges(self, robot: SimulatedRobot) -> None:
        """Bring the charges of a robot and its partner up to date, before they do something else."""
        self._charges.settle(self.now_ms, *filter(None, (robot.name, robot.partner)))

    def _aboard(self, name: str) -> str | None:
        """Return the carrier that a robot is aboard; None while it docks."""
        robot = self._robots[name]
        return None if robot.activity in _DOCKINGS else robot.carrier

    def _use(self, name: str) -> BatteryUse:
        """Return what a robot does with its battery."""
        robot = self._robots[name]
        driving = robot.activity is RobotActivity.DRIVING
        step_ms, step_m = 0, 0.0
        if driving and robot.step and robot.times_ms[robot.step] > self.now_ms:
            before, there = robot.route[robot.step - 1 : robot.step + 1]
            cells = 1.0 if before.x == there.x or before.y == there.y else robot.kind.diagonal
            step_m = cells * self.grid.resolution_m
            step_ms = int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
        return BatteryUse(
            driving_ms=robot.driving_ms,
            distance_m=self.distance_m(name),
            charging=self._aboard(name) is not None or (robot.cell in self._truth.chargers and not driving),
            lost=robot.lost,
            free_at_ms=int(robot.times_ms[robot.step]) if driving else robot.free_at_ms,
            step_ms=step_ms,
            step_m=step_m,
        )

    def _watch(self, robot: SimulatedRobot) -> None:
        """Look at the battery of a robot when it may be empty at the earliest."""
        if robot.kind.battery is None or robot.lost or self._use(robot.name).charging:
            return
        power_w = robot.kind.power_w(driving=robot.activity is RobotActivity.DRIVING, speed=robot.speed)
        power_w += self._charges.given_w(robot.name, self.now_ms)
        if not power_w:
            return
        left_j = self._charges.share(robot.name, self.now_ms) * robot.kind.battery.capacity_j
        at_ms = self.now_ms + max(_LEAST_MS, int(1000 * left_j / power_w))
        if not self.now_ms < self._looks.get(robot.name, 0) <= at_ms:
            self._looks[robot.name] = at_ms
            self._push(at_ms, robot.name, _LOOK)

    def _happen(self, number: int, name: str) -> None:
        if number != _LOOK:
            super()._happen(number, name)
        elif self._looks[name] == self.now_ms and not self._empty(self._robots[name]):
            self._watch(self._robots[name])

    def _step(self, robot: SimulatedRobot) -> bool:
        ended = super()._step(robot)
        return not self._empty(robot) and ended

    def _empty(self, robot: SimulatedRobot) -> bool:
        """Return whether the battery of a robot on the ground is empty; then the robot fails."""
        if robot.kind.battery is None or self._use(robot.name).charging:
            return False
        empty = self._charges.share(robot.name, self.now_ms) < -_ROUNDING
        if empty:
            self._fail(robot, "has an empty battery")
        return empty

    def _complete(self, robot: SimulatedRobot) -> None:
        self._settle_charges(robot)
        super()._complete(robot)
        if robot.carrier is not None:  # it charges there
            self._watch(self._robots[robot.carrier])

    def _lose(self, robot: SimulatedRobot, what: str = "failed") -> list[tuple[str, str]]:
        if not robot.lost:
            self._settle_charges(robot)
        return super()._lose(robot, what)

    def _end_command(self, robot: SimulatedRobot) -> None:
        if robot.activity is not RobotActivity.NONE:
            self._settle_charges(robot)
        super()._end_command(robot)

    def _return(self, robot: SimulatedRobot) -> None:
        lost = robot.lost
        super()._return(robot)
        if lost and not robot.lost:
            self._charges.resume(self.now_ms, robot.name)
            self._watch(robot)
