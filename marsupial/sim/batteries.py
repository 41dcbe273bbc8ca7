"""Batteries in the simulator: they run down on the ground and charge aboard; a robot with an empty one fails.

The charge is computed when it is needed, from the time and from the driving since it was last computed. So that a robot
fails at the right time even if nothing else happens to it, an event looks at its battery when it may be empty at the
earliest.
"""

from collections.abc import Mapping
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
        for name in self._charges:
            self._watch(self._robots[name])

    def dock(self, rover: str, carrier: str) -> None:
        self._charge_j(self._robots[rover])
        super().dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        self._charge_j(self._robots[rover])
        super().undock(rover, carrier, cell)
        self._watch(self._robots[rover])

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        if robot.name not in self._charges:
            return report
        level_j, ahead_s = self._charge_j(robot), max(0, report.free_at_ms - self.now_ms) / 1000
        if not self._charging(robot):
            level_j -= robot.kind.power_w(driving=False) * ahead_s
        if robot.activity is RobotActivity.DOCKING:  # the rover counts as aboard, as if it charged
            level_j -= self._charges[robot.name].battery.charge_w * ahead_s
        if robot.activity is RobotActivity.DRIVING and robot.times_ms[robot.step] > self.now_ms and robot.step:
            before, there = robot.route[robot.step - 1 : robot.step + 1]
            cells = 1.0 if before.x == there.x or before.y == there.y else robot.kind.diagonal
            took_ms = int(robot.times_ms[robot.step] - robot.times_ms[robot.step - 1])
            level_j -= self._driving_j(robot, took_ms, cells)
        return replace(report, charge=max(0.0, level_j) / self._charges[robot.name].battery.capacity_j)

    def _charge_j(self, robot: SimulatedRobot) -> float:
        """Return the present charge of a robot's battery, and compute the next one from it; inf without a battery."""
        charge = self._charges.get(robot.name)
        if charge is None:
            return float("inf")
        past_s = (self.now_ms - charge.at_ms) / 1000
        if self._charging(robot):
            charge.level_j = min(charge.battery.capacity_j, charge.level_j + charge.battery.charge_w * past_s)
        else:
            drove_ms, drove = robot.driving_ms - charge.driving_ms, robot.distance_cells - charge.distance_cells
            charge.level_j -= robot.kind.power_w(driving=False) * past_s + self._driving_j(robot, drove_ms, drove)
        charge.at_ms, charge.driving_ms, charge.distance_cells = self.now_ms, robot.driving_ms, robot.distance_cells
        return charge.level_j

    def _driving_j(self, robot: SimulatedRobot, driving_ms: int, cells: float) -> float:
        """Return the energy of a drive in addition to standing."""
        energy = robot.kind.energy
        return energy.drive_w * driving_ms / 1000 + energy.metre_j * cells * self.grid.resolution_m

    def _charging(self, robot: SimulatedRobot) -> bool:
        return robot.carrier is not None and robot.activity not in _DOCKINGS

    def _watch(self, robot: SimulatedRobot) -> None:
        """Look at the battery of a robot on the ground when it may be empty at the earliest."""
        if self._charging(robot) or robot.lost or robot.name not in self._charges:
            return
        power_w = robot.kind.power_w(driving=robot.activity is RobotActivity.DRIVING, speed=robot.speed)
        if power_w:
            after_ms = int(1000 * self._charge_j(robot) / power_w)
            self._push(self.now_ms + max(_LEAST_MS, after_ms), robot.name, _LOOK)

    def _happen(self, number: int, name: str) -> None:
        if number != _LOOK:
            super()._happen(number, name)
        elif not self._empty(self._robots[name]):
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
        for name in filter(None, (robot.name, robot.partner)):
            self._charge_j(self._robots[name])
        super()._end_command(robot)

    def _return(self, robot: SimulatedRobot) -> None:
        super()._return(robot)
        self._watch(robot)
