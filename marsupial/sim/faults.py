"""Faults in the simulator: robots fail, return, slow down or get stuck, and ground changes.

A fault (`marsupial.model.faults`) that happens at a time is an event, `FaultDue`. One that can't happen yet, as robots
stand in its area or dock, is tried again later. Before ground that has changed since it was seen, a robot stops, and
its drive fails. Cells that sensors miss are left to `marsupial.sim.sensing`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from marsupial.maps.discs import disc, fits
from marsupial.model import UNKNOWN, Cell
from marsupial.model.faults import Fault, FaultKind
from marsupial.paths.routes import route_length
from marsupial.sim.motion import Motion, RobotActivity, RobotDue, Rule, SimulatedCommand, SimulatedDrive, SimulatedRobot
from marsupial.sim.sensing import Sensing

_AGAIN_MS = 1000  # least time until ground that robots stand on is tried again to change


@dataclass(frozen=True, slots=True)
class FaultDue:
    """A fault happens, now or as soon as it can."""

    fault: Fault


class Faults(Rule):
    """Lets dated faults happen (`marsupial.model.faults.dated`)."""

    def __init__(self, motion: Motion, sensing: Sensing, faults: Sequence[Fault]) -> None:
        self._motion = motion
        self._sensing = sensing
        self._when_seen: list[Fault] = []  # those that happen when a cell is seen
        self._noise: list[tuple[str | None, float, np.random.Generator]] = []  # robot, share of the way
        self._back_ms: dict[str, int] = {}  # when the last fault that brings a robot back happens
        self._changing = any(fault.kind is FaultKind.GROUND for fault in faults)
        for fault in faults:
            if fault.kind is FaultKind.POSITION_NOISE:
                self._noise.append((fault.robot, fault.share, np.random.default_rng(fault.seed)))
            elif fault.at_ms is not None:
                motion.at(fault.at_ms, FaultDue(fault))
            elif fault.seen is not None:
                self._when_seen.append(fault)
            if fault.kind in (FaultKind.RETURNS, FaultKind.JOINS) and fault.robot is not None:
                self._back_ms[fault.robot] = max(fault.at_ms or 0, self._back_ms.get(fault.robot, 0))
            if fault.kind is FaultKind.JOINS and fault.robot is not None:
                motion.fail(motion.team[fault.robot], "is absent until it joins")

    def report(self, robot: SimulatedRobot, fields: dict[str, Any]) -> None:
        if robot.lost:
            fields["returns"] = self._returns(robot)

    def _returns(self, robot: SimulatedRobot) -> bool:
        """Return whether a fault brings a lost robot back; one that is aboard a lost carrier can't act before that."""
        back_ms = self._back_ms.get(robot.name, 0)
        if robot.carrier is not None and (host := self._motion.team[robot.carrier]).lost:
            follows = robot.lost_with is not None or self._back_ms.get(host.name, 0) <= back_ms
            return follows and self._returns(host)
        return self._motion.now_ms < back_ms

    # commands

    def accepts(self, command: SimulatedCommand) -> bool:
        """Return whether no robot refuses the command that it gets."""
        robot = next((one for one in command.robots if one.declines), None)
        if robot is None:
            return True
        robot.declines = False
        self._motion.moment.declined += _for_each(command.robots, f"{robot.name} declined")
        return False

    def begins(self, command: SimulatedCommand) -> SimulatedCommand | None:
        if not self.accepts(command):  # since it was given
            return None
        if isinstance(command, SimulatedDrive):
            return SimulatedDrive(command.robots, self._astray(*command.robots, command.route))
        (rover, carrier), landing = command.robots, command.landing
        # noise may have left the rover, or its landing, too far from its carrier
        at = rover.cell if landing is None else landing
        if self._noise and not self._motion.in_reach(rover, carrier, at):
            self._motion.moment.failed += _for_each(command.robots, "too far apart")
            return None
        if landing is not None and self._is_shut(rover, landing):
            self._motion.moment.failed += _for_each(command.robots, "no ground to land on")
            return None
        return command

    def _astray(self, robot: SimulatedRobot, route: Sequence[Cell]) -> Sequence[Cell]:
        """Return a route as it is driven with noise: on from its end, as far as there is room that way."""
        if not self._noise:
            return route
        driven = list(route)
        length = route_length(route, robot.kind.diagonal)
        for name, share, rng in self._noise:
            if name in (None, robot.name):
                x, y = map(round, rng.normal(0.0, share * length, 2))
                while x or y:
                    here, step = driven[-1], (_sign(x), _sign(y))
                    there = Cell(here.x + step[0], here.y + step[1])
                    if not fits(self._motion.truth, robot.kind, *_step_cells(here, there)):
                        break
                    driven.append(there)
                    x, y = x - step[0], y - step[1]
        robot.astray = (driven[-1], route[-1])
        return driven

    def may_set_off(self, robot: SimulatedRobot) -> bool:
        """Return whether the ground ahead is open; if it has closed, the robot's drive fails here."""
        step = robot.route[robot.step : robot.step + 2] if self._changing else ()
        if len(step) < 2 or not self._is_shut(robot, *_step_cells(*step)):
            return True
        self._motion.moment.failed.append((robot.name, "no ground ahead"))
        self._motion.halt(robot)
        return False

    def _is_shut(self, robot: SimulatedRobot, *cells: Cell) -> bool:
        """Return whether ground has changed so that a robot can't stand on one of these cells; then it notices."""
        if not self._changing or fits(self._motion.truth, robot.kind, *cells):
            return False
        grid = self._motion.grid
        x, y = (np.array(cells)[:, None] + disc(robot.kind.radius_m / grid.resolution_m)).reshape(-1, 2).T
        self._sensing.learn(robot, np.empty(0, dtype=np.int64), y * grid.width + x)
        return True

    def on_step(self, robot: SimulatedRobot, *, ended: bool) -> bool:
        """Let a docking or undocking fail at its end, if a robot's slip is due."""
        carrier = robot.partner
        slips = [one for one in sorted(robot.pair, key=lambda one: one.name) if one.slips] if ended else []
        if carrier is None or not slips:
            return ended
        slips[0].slips -= 1
        undocks = robot.activity is RobotActivity.UNDOCKING
        self._motion.moment.failed += _for_each(robot.pair, f"{robot.activity} failed")
        self._motion.end_command(robot)
        robot.cell, robot.carrier = robot.left, carrier.name if undocks else None
        if undocks:
            self._motion.after_change(carrier)
        return False

    # what happens

    def look(self, robot: SimulatedRobot) -> None:
        """Let faults happen whose place has just been seen for the first time."""
        for fault in self._when_seen.copy():
            if fault.seen is not None and self._sensing.map_of(robot)[fault.seen.y, fault.seen.x] != UNKNOWN:
                self._when_seen.remove(fault)
                self._motion.at(self._motion.now_ms, FaultDue(fault))

    def on_time(self, event: object) -> None:
        if isinstance(event, FaultDue):
            self._strike(event)

    def _strike(self, due: FaultDue) -> None:
        """Let a fault happen, now or when it can."""
        motion, fault, now_ms = self._motion, due.fault, self._motion.now_ms
        if fault.kind is FaultKind.GROUND:
            if self._is_occupied(fault):
                # less and less often, as robots may stand there for hours
                motion.at(now_ms + max(_AGAIN_MS, (now_ms - (fault.at_ms or 0)) // 8), due)
            else:
                self._change_ground(fault)
            return
        assert fault.robot is not None
        robot = motion.team[fault.robot]
        match fault.kind:
            case FaultKind.LOST:
                motion.fail(robot, "failed")
            case FaultKind.RETURNS | FaultKind.JOINS:
                self._return(robot)
            case FaultKind.SLOWS if robot.speed != fault.share:
                robot.speed = fault.share
                robot.slowed_ms = now_ms if robot.activity is RobotActivity.DRIVING else None
                robot.tells_speed = fault.reported
                self._tell_speed(robot)
            case FaultKind.STUCK if robot.partner is not None:
                motion.at(robot.free_at_ms + 1, due)  # dockings aren't interrupted
            case FaultKind.STUCK if robot.cell is not None and not robot.lost:
                free_at_ms = max(robot.free_at_ms, now_ms + fault.for_ms)
                if robot.activity is RobotActivity.DRIVING:
                    motion.moment.failed.append((robot.name, "stuck"))
                motion.halt(robot)
                robot.free_at_ms = free_at_ms
            case FaultKind.DECLINES:
                robot.declines = True
            case FaultKind.DOCKING_FAILS:
                robot.slips += 1

    def _tell_speed(self, robot: SimulatedRobot) -> None:
        """Report a robot's new speed, if it does; a lost one reports it when it returns."""
        if robot.tells_speed and not robot.lost and robot.told_speed != robot.speed:
            robot.told_speed = robot.speed
            self._motion.moment.slowed.append((robot.name, robot.speed))

    def _return(self, robot: SimulatedRobot) -> None:
        """Make a lost robot act again, with the rovers that were lost aboard it; one without a place aboard can't."""
        motion = self._motion
        if not robot.lost:
            return
        if robot.carrier is not None:
            host = motion.team[robot.carrier]
            if host.lost or not motion.has_place(host, robot):
                return
        robot.lost, robot.lost_with, robot.free_at_ms = False, None, motion.now_ms
        motion.moment.returned.append(robot.name)
        self._tell_speed(robot)
        if robot.cell is not None:
            motion.look(robot)
        for other in motion.team.values():
            if other.lost_with == robot.name and other.carrier == robot.name:
                self._return(other)
        motion.after_change(robot)

    def _is_occupied(self, fault: Fault) -> bool:
        """Return whether the body of a robot on the ground is in the area of a fault, or on its way there."""
        assert fault.area is not None
        low, high = fault.area
        for robot in self._motion.team.values():
            step = robot.route[max(0, robot.step - 1) : robot.step + 1]
            for cell in (robot.cell, robot.left if robot.partner else None, *_step_cells(*step)):
                if cell is not None:
                    at = np.array(cell) + disc(robot.kind.radius_m / self._motion.grid.resolution_m)
                    if ((at >= low) & (at <= high)).all(axis=1).any():
                        return True
        return False

    def _change_ground(self, fault: Fault) -> None:
        """Change the true terrain of an area; robots that stand look at it at once, driving ones at their next cell."""
        assert fault.area is not None
        low, high = fault.area
        motion = self._motion
        cells = motion.truth.cells.copy()
        cells[low.y : high.y + 1, low.x : high.x + 1] = fault.terrain
        motion.truth = replace(motion.truth, cells=cells)
        self._sensing.forget()
        for robot in motion.team.values():
            if robot.activity is RobotActivity.NONE and robot.cell is not None and not robot.lost:
                motion.at(motion.now_ms, RobotDue(robot, robot.due))


def _for_each(robots: Iterable[SimulatedRobot], reason: str) -> list[tuple[str, str]]:
    """Return the news that a command of these robots has come to nothing."""
    return [(name, reason) for name in sorted(robot.name for robot in robots)]


def _step_cells(*ends: Cell) -> set[Cell]:
    """Return the cells between which a step leads, and those beside it if it is diagonal: robots cut no corners."""
    return {Cell(a.x, b.y) for a in ends for b in ends}


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)
