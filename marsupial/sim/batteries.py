"""Batteries in the simulator: they run down on the ground; a robot with an empty one fails.

They charge aboard and at charging places (`marsupial.model.situation.PlanningBattery` has the rules).

The charge is computed when it is needed, from the time and from the driving since it was last computed. So that a robot
fails at the right time even if nothing else happens to it, an event looks at its battery when it may be empty at the
earliest.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from marsupial.model import Battery, Cell, RobotReport, RobotType
from marsupial.sim.faults import FaultyWorld
from marsupial.sim.world import RobotActivity, SimulatedRobot

_LOOK = -1  # event number of looks at a battery

_LEAST_MS = 100  # least time between two looks

_ROUNDING_J = 1e-6

_DOCKINGS = (RobotActivity.DOCKING, RobotActivity.UNDOCKING)


@dataclass(slots=True)
class _Charge:
    """The charge of a battery at a time, and how long and how far its robot had driven by then."""

    battery: Battery
    level_j: float
    at_ms: int = 0
    driving_ms: int = 0
    distance_cells: float = 0.0


class BatteryWorld(FaultyWorld):
    """A simulated `World` in which robots have the batteries of their types, full at first."""

    def _set_up(self, kinds: Mapping[str, RobotType]) -> None:
        super()._set_up(kinds)
        self._charges = {
            name: _Charge(robot.kind.battery, robot.kind.battery.capacity_j)
            for name, robot in self._robots.items()
            if robot.kind.battery is not None
        }
        self._looks: dict[str, int] = {}  # when to look at each battery next
        for name in self._charges:
            self._watch(self._robots[name])

    def dock(self, rover: str, carrier: str) -> None:
        self._look_at(rover, carrier)
        super().dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._look_at(rover, carrier)
        super().undock(rover, carrier, cell)
        self._watch(self._robots[rover])

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self._look_at(robot)
        super().drive(robot, route)
        self._watch(self._robots[robot])

    def _look_at(self, *names: str) -> None:
        """Bring charges up to date before robots do something else."""
        for name in names:
            self._charge_j(self._robots[name])

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        if robot.name not in self._charges:
            return report
        level_j, ahead_s = self._charge_j(robot), max(0, report.free_at_ms - self.now_ms) / 1000
        if not self._charging(robot):
            level_j -= robot.kind.power_w(driving=False) * ahead_s
        if robot.activity is RobotActivity.DRIVING and robot.times_ms[robot.step] > self.now_ms and robot.step:
            before, there = robot.route[robot.step - 1 : robot.step + 1]
            cells = 1.0 if before.x == there.x or before.y == there.y else robot.kind.diagonal
            took_ms = int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
            level_j -= self._driving_j(robot, took_ms, cells)
        return replace(report, charge=max(0.0, level_j) / self._charges[robot.name].battery.capacity_j)

    def _charge_j(self, robot: SimulatedRobot) -> float:
        """Return the present charge of a robot's battery, and compute the next one from it; inf without a battery."""
        given_j = sum(self._gain_j(rover) for rover in self._aboard(robot)) if robot.kind.capacity else 0.0
        charge = self._charges.get(robot.name)
        if charge is None:
            return math.inf
        if robot.carrier is None or robot.activity in _DOCKINGS:
            past_s = (self.now_ms - charge.at_ms) / 1000
            drove_ms, drove = robot.driving_ms - charge.driving_ms, robot.distance_cells - charge.distance_cells
            if self._charging(robot):
                charge.level_j = min(charge.battery.capacity_j, charge.level_j + charge.battery.charge_w * past_s)
            else:
                charge.level_j -= robot.kind.power_w(driving=False) * past_s + given_j
                charge.level_j -= self._driving_j(robot, drove_ms, drove)
            charge.at_ms, charge.driving_ms, charge.distance_cells = self.now_ms, robot.driving_ms, robot.distance_cells
        else:
            self._charge_j(self._robots[robot.carrier])  # its carrier gives it the charge
        return charge.level_j

    def _gain_j(self, rover: SimulatedRobot) -> float:
        """Charge the battery of a rover aboard; return what it gains."""
        charge = self._charges.get(rover.name)
        if charge is None:
            return 0.0
        past_s, before_j = (self.now_ms - charge.at_ms) / 1000, charge.level_j
        charge.level_j = min(charge.battery.capacity_j, before_j + charge.battery.charge_w * past_s)
        charge.at_ms = self.now_ms
        return charge.level_j - before_j

    def _aboard(self, carrier: SimulatedRobot) -> Iterator[SimulatedRobot]:
        """Yield the rovers aboard a carrier, without those that dock."""
        for rover in self._robots.values():
            if rover.carrier == carrier.name and rover.activity not in _DOCKINGS:
                yield rover

    def _driving_j(self, robot: SimulatedRobot, driving_ms: int, cells: float) -> float:
        """Return the energy of a drive in addition to standing."""
        energy = robot.kind.energy
        return energy.drive_w * driving_ms / 1000 + energy.metre_j * cells * self.grid.resolution_m

    def _charging(self, robot: SimulatedRobot) -> bool:
        if robot.carrier is not None and robot.activity not in _DOCKINGS:
            return True
        return robot.cell in self._truth.chargers and robot.activity is not RobotActivity.DRIVING

    def _watch(self, robot: SimulatedRobot) -> None:
        """Look at the battery of a robot when it may be empty at the earliest."""
        if robot.name not in self._charges or robot.lost or self._charging(robot):
            return
        power_w = robot.kind.power_w(driving=robot.activity is RobotActivity.DRIVING, speed=robot.speed)
        if not power_w:
            return
        at_ms = self.now_ms + max(_LEAST_MS, int(1000 * self._charge_j(robot) / power_w))
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
        empty = not self._charging(robot) and self._charge_j(robot) < -_ROUNDING_J
        if empty:
            self._fail(robot, "has an empty battery")
        return empty

    def _end_command(self, robot: SimulatedRobot) -> None:
        self._look_at(*filter(None, (robot.name, robot.partner)))
        super()._end_command(robot)

    def _return(self, robot: SimulatedRobot) -> None:
        super()._return(robot)
        self._watch(robot)
