"""Faults in the simulator: robots fail, return, slow down or get stuck, and ground changes.

A fault (`marsupial.model.faults`) is an event of the simulator with a number from `FIRST_FAULT` down. A fault that
can't happen yet, as robots stand in its area or dock, is tried again later. Before ground that has changed since it was
seen, a robot stops, and its drive fails.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.discs import disc, fits
from marsupial.maps.territory import dock_range_cells, within_range
from marsupial.model import UNKNOWN, Cell, Grid, PlacedRobot, RobotReport, RobotType
from marsupial.model.faults import Fault, FaultKind
from marsupial.paths.routes import route_length
from marsupial.sim.sensors import Sensor
from marsupial.sim.world import FIRST_FAULT, RobotActivity, SimulatedRobot, SimulatedWorld

_AGAIN_MS = 1000  # least time until ground that robots stand on is tried again to change


class FaultyWorld(SimulatedWorld):
    """A simulated `World` in which faults happen; they are dated (`marsupial.model.faults.dated`)."""

    def __init__(
        self,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        robots: Sequence[PlacedRobot],
        faults: Sequence[Fault] = (),
        sensor: Sensor | None = None,
    ) -> None:
        super().__init__(truth, kinds, robots, sensor)
        self._faults = faults
        self._when_seen: dict[int, Fault] = {}  # by number: those that happen when a cell is seen
        self._misses: list[tuple[float, np.random.Generator]] = []  # shares of missed cells
        self._noise: list[tuple[str | None, float, np.random.Generator]] = []  # robot, share of the way
        self._back_ms: dict[str, int] = {}  # when the last fault that brings a robot back happens
        self._changing = any(fault.kind is FaultKind.GROUND for fault in faults)
        for i, fault in enumerate(faults):
            if fault.kind is FaultKind.MISSED_CELLS:
                self._misses.append((fault.share, np.random.default_rng(fault.seed)))
                self._exact = False
            elif fault.kind is FaultKind.POSITION_NOISE:
                self._noise.append((fault.robot, fault.share, np.random.default_rng(fault.seed)))
            elif fault.at_ms is not None:
                self._push(fault.at_ms, fault.robot or "", FIRST_FAULT - i)
            else:
                self._when_seen[FIRST_FAULT - i] = fault
            if fault.kind in (FaultKind.RETURNS, FaultKind.JOINS) and fault.robot is not None:
                self._back_ms[fault.robot] = max(fault.at_ms or 0, self._back_ms.get(fault.robot, 0))
            if fault.kind is FaultKind.JOINS and fault.robot is not None:
                self._fail(self._robots[fault.robot], "is absent until it joins")

    def _report(self, robot: SimulatedRobot) -> RobotReport:
        report = super()._report(robot)
        return replace(report, returns=self._returns(robot)) if robot.lost else report

    def _returns(self, robot: SimulatedRobot) -> bool:
        """Return whether a fault brings a lost robot back; one that is aboard a lost carrier can't act before that."""
        back_ms = self._back_ms.get(robot.name, 0)
        if robot.carrier is not None and (host := self._robots[robot.carrier]).lost:
            follows = robot.lost_with is not None or self._back_ms.get(host.name, 0) <= back_ms
            return follows and self._returns(host)
        return self.now_ms < back_ms

    # commands

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        if not self._declined(robot):
            super().drive(robot, self._astray(self._robots[robot], route))

    def dock(self, rover: str, carrier: str) -> None:
        if not self._declined(rover, carrier) and not self._too_far(rover, carrier, self._robots[rover].cell):
            super().dock(rover, carrier)

    def undock(self, rover: str, carrier: str, cell: Cell) -> None:
        if self._declined(rover, carrier) or self._too_far(rover, carrier, cell):
            return
        if self._is_shut(self._robots[rover], cell):
            self._moment.failed += [(name, "no ground to land on") for name in sorted((rover, carrier))]
            return
        super().undock(rover, carrier, cell)

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
                    if not fits(self._truth, robot.kind, *_step_cells(here, there)):
                        break
                    driven.append(there)
                    x, y = x - step[0], y - step[1]
        robot.astray = (driven[-1], route[-1])
        return driven

    def _next_step(self, robot: SimulatedRobot) -> None:
        step = robot.route[robot.step : robot.step + 2] if self._changing else ()
        if len(step) == 2 and self._is_shut(robot, *_step_cells(*step)):
            self._moment.failed.append((robot.name, "no ground ahead"))
            self._halt(robot)
        else:
            super()._next_step(robot)

    def _is_shut(self, robot: SimulatedRobot, *cells: Cell) -> bool:
        """Return whether ground has changed so that a robot can't stand on one of these cells; then it notices."""
        if not self._changing or fits(self._truth, robot.kind, *cells):
            return False
        x, y = (np.array(cells)[:, None] + disc(robot.kind.radius_m / self.grid.resolution_m)).reshape(-1, 2).T
        self._learn(robot, np.empty(0, dtype=np.int64), y * self.grid.width + x)
        return True

    def _too_far(self, rover: str, carrier: str, at: Cell | None) -> bool:
        """Return whether noise has left a rover, or its landing, too far from its carrier: then both fail."""
        far = bool(self._noise) and not self._in_reach(self._robots[rover], self._robots[carrier], at)
        if far:
            self._moment.failed += [(name, "too far apart") for name in sorted((rover, carrier))]
        return far

    def _in_reach(self, rover: SimulatedRobot, carrier: SimulatedRobot, at: Cell | None) -> bool:
        """Return whether a rover at a cell is near enough to its carrier to dock, or to be set down there."""
        limit = dock_range_cells(carrier.kind, rover.kind, self.grid.resolution_m)
        see_through = self.grid.opaque_codes()[self._known] == 0
        return at is None or carrier.cell is None or within_range(at, carrier.cell, limit, see_through)

    def _declined(self, *names: str) -> bool:
        """Return whether one of these robots refuses the command that they get."""
        robot = next((one for name in names if (one := self._robots[name]).declines), None)
        if robot is None:
            return False
        robot.declines = False
        self._moment.declined += [(name, f"{robot.name} declined") for name in sorted(names)]
        return True

    def _complete(self, robot: SimulatedRobot) -> None:
        names = [robot.name] if robot.partner is None else sorted((robot.name, robot.partner))
        slips = [one for name in names if (one := self._robots[name]).slips] if robot.partner else []
        if not slips:
            super()._complete(robot)
            return
        slips[0].slips -= 1
        carrier = robot.partner if robot.activity is RobotActivity.UNDOCKING else None
        robot.cell, robot.carrier = robot.left, carrier
        self._moment.failed += [(name, f"{robot.activity} failed") for name in names]
        self._end_command(robot)

    # sensing

    def _look_round(self, robot: SimulatedRobot) -> None:
        super()._look_round(robot)
        for number, fault in list(self._when_seen.items()):
            if fault.seen is not None and self._map_of(robot)[fault.seen.y, fault.seen.x] != UNKNOWN:
                del self._when_seen[number]
                self._push(self.now_ms, fault.robot or robot.name, number)

    @property
    def _sees_known(self) -> bool:
        return self._changing or bool(self._misses)

    def _seen(self, robot: SimulatedRobot, cell: Cell) -> Ints:
        seen = super()._seen(robot, cell)
        for share, rng in self._misses:
            seen = seen[rng.random(len(seen)) >= share]
        return seen

    def _learn(self, robot: SimulatedRobot, seen: Ints, touched: Ints) -> None:
        if self._changing:
            noticed = np.union1d(seen, touched)
            known, codes = self._map_of(robot).ravel(), self._truth.cells.ravel()[noticed]
            differs = (known[noticed] != UNKNOWN) & (known[noticed] != codes)
            changed = noticed[differs]
            known[changed] = codes[differs]
            if len(changed) and robot.held is None:
                self._moment.changed.append((robot.name, changed))
        super()._learn(robot, seen, touched)

    # what happens

    def _happen(self, number: int, name: str) -> None:
        if number <= FIRST_FAULT:
            self._strike(self._faults[FIRST_FAULT - number], number)

    def _strike(self, fault: Fault, number: int) -> None:
        """Let the fault of an event number happen, now or when it can."""
        now_ms = self.now_ms
        if fault.kind is FaultKind.GROUND:
            if self._is_occupied(fault):
                # less and less often, as robots may stand there for hours
                self._push(now_ms + max(_AGAIN_MS, (now_ms - (fault.at_ms or 0)) // 8), "", number)
            else:
                self._change_ground(fault)
            return
        assert fault.robot is not None
        robot = self._robots[fault.robot]
        match fault.kind:
            case FaultKind.LOST:
                self._fail(robot)
            case FaultKind.RETURNS | FaultKind.JOINS:
                self._return(robot)
            case FaultKind.SLOWS if robot.speed != fault.share:
                robot.speed = fault.share
                robot.slowed_ms = self.now_ms if robot.activity is RobotActivity.DRIVING else None
                robot.tells_speed = fault.reported
                self._tell_speed(robot)
            case FaultKind.STUCK if robot.partner is not None:
                self._push(robot.free_at_ms + 1, robot.name, number)  # dockings aren't interrupted
            case FaultKind.STUCK if robot.cell is not None and not robot.lost:
                free_at_ms = max(robot.free_at_ms, now_ms + fault.for_ms)
                if robot.activity is RobotActivity.DRIVING:
                    self._moment.failed.append((robot.name, "stuck"))
                self._halt(robot)
                robot.free_at_ms = free_at_ms
            case FaultKind.DECLINES:
                robot.declines = True
            case FaultKind.DOCKING_FAILS:
                robot.slips += 1

    def _halt(self, robot: SimulatedRobot) -> None:
        """Stop a robot where it stands, without an end of its command."""
        robot.odometer.arrive(self.now_ms)
        robot.due += 1
        self._end_command(robot)

    def _fail(self, robot: SimulatedRobot, what: str = "failed") -> None:
        """Let a robot fail, with all rovers aboard."""
        lost = self._lose(robot, what)
        names = [name for name, _ in lost]
        self._moment.lost += lost
        self._moment.returned = [name for name in self._moment.returned if name not in names]  # lost again

    def _lose(self, robot: SimulatedRobot, what: str = "failed") -> list[tuple[str, str]]:
        """Mark `robot` as lost, with all rovers aboard; a rover that docks stays where it stands."""
        if robot.lost:
            return []
        # the event of a docking is the rover's, so both numbers have to change
        partner = robot.partner
        if partner is not None and robot.activity is RobotActivity.DOCKING:
            rover = robot if robot.carrier == partner else self._robots[partner]
            rover.cell, rover.carrier = rover.left, None
        robot.due += 1
        self._end_command(robot)
        robot.lost = True
        news = [(robot.name, what)]
        if partner is not None:
            self._robots[partner].due += 1
        for other in self._robots.values():
            if other.carrier == robot.name and not other.lost:
                other.lost, other.lost_with = True, robot.name
                news.append((other.name, f"aboard {robot.name}, which {what}"))
        return news

    def _tell_speed(self, robot: SimulatedRobot) -> None:
        """Report a robot's new speed, if it does; a lost one reports it when it returns."""
        if robot.tells_speed and not robot.lost and robot.told_speed != robot.speed:
            robot.told_speed = robot.speed
            self._moment.slowed.append((robot.name, robot.speed))

    def _return(self, robot: SimulatedRobot) -> None:
        """Make a lost robot act again, with the rovers that were lost aboard it; one without a place aboard can't."""
        if not robot.lost:
            return
        if robot.carrier is not None:
            host = self._robots[robot.carrier]
            if host.lost or not self._has_place(host, robot):
                return
        robot.lost, robot.lost_with, robot.free_at_ms = False, None, self.now_ms
        self._moment.returned.append(robot.name)
        self._tell_speed(robot)
        if robot.cell is not None:
            self._look_round(robot)
        for other in self._robots.values():
            if other.lost_with == robot.name and other.carrier == robot.name:
                self._return(other)

    def _is_occupied(self, fault: Fault) -> bool:
        """Return whether the body of a robot on the ground is in the area of a fault, or on its way there."""
        assert fault.area is not None
        low, high = fault.area
        for robot in self._robots.values():
            step = robot.route[max(0, robot.step - 1) : robot.step + 1]
            for cell in (robot.cell, robot.left if robot.partner else None, *_step_cells(*step)):
                if cell is not None:
                    at = np.array(cell) + disc(robot.kind.radius_m / self.grid.resolution_m)
                    if ((at >= low) & (at <= high)).all(axis=1).any():
                        return True
        return False

    def _change_ground(self, fault: Fault) -> None:
        """Change the true terrain of an area; robots that stand look at it at once, driving ones at their next cell."""
        assert fault.area is not None
        low, high = fault.area
        cells = self._truth.cells.copy()
        cells[low.y : high.y + 1, low.x : high.x + 1] = fault.terrain
        self._truth = replace(self._truth, cells=cells)
        self._sensed.clear()
        for name, robot in self._robots.items():
            if robot.activity is RobotActivity.NONE and robot.cell is not None and not robot.lost:
                self._push(self.now_ms, name, robot.due)


def _step_cells(*ends: Cell) -> set[Cell]:
    """Return the cells between which a step leads, and those beside it if it is diagonal: robots cut no corners."""
    return {Cell(a.x, b.y) for a in ends for b in ends}


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)
