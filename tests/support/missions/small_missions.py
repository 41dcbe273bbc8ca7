"""Missions of small teams, and a watcher that checks the physical rules."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import TypeVar

import numpy as np
from support.missions.small_teams import kinds_of

from marsupial.library import recording
from marsupial.maps.footprint import footprint_of
from marsupial.mission.goals import MissionOrder
from marsupial.mission.loop import MissionLoop
from marsupial.mission.observer import Observer, Observers
from marsupial.model import ActionStarted, DriveStarted, MissionEnded, MissionEvent, MissionStarted
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.grid import OBSTACLE, UNKNOWN, Cell, Grid
from marsupial.model.mission import ActionEnd, ActionEnded, DriveEnded, PlacedRobot, Planned, Revealed, RobotLost
from marsupial.model.plan import ActionName
from marsupial.model.planning import Budget
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.strategy import PlanningReport, Strategy
from marsupial.paths.routes import passing_times_ms, route_of
from marsupial.planning.greedy import Greedy
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies.temporal import Temporal


def greedy_strategy() -> Strategy:
    """Return the temporal strategy with the greedy engine and one round per plan."""
    return Temporal(Greedy(), Budget(steps=1))


Kind = TypeVar("Kind", bound=MissionEvent)


class Recorder(recording.Recorder):
    """Records events and planning reports."""

    def __init__(self) -> None:
        super().__init__()
        self.reports: list[PlanningReport] = []

    def planned(self, report: PlanningReport) -> None:
        self.reports.append(report)

    def of(self, kind: type[Kind]) -> list[Kind]:
        return [event for event in self.events if isinstance(event, kind)]


class Watcher(Recorder):
    """Records, and adds every violation of physical rules to `faults`."""

    def __init__(self, grid: Grid, kinds: Mapping[str, RobotType], robots: Sequence[PlacedRobot]) -> None:
        super().__init__()
        self.faults: list[str] = []
        self._grid = grid
        self._known = np.full_like(grid.cells, UNKNOWN)
        self._kinds = {robot.name: kinds[robot.type] for robot in robots}
        self.cell = {robot.name: robot.cell for robot in robots}
        self.carrier = {robot.name: robot.carrier for robot in robots}
        self._drives: dict[str, DriveStarted] = {}
        self._running: dict[str, ActionStarted] = {}
        self._lost: set[str] = set()
        self._before: dict[str, tuple[Cell | None, str | None]] = {}

    def event(self, event: MissionEvent) -> None:
        if self.events and event.t_ms < self.events[-1].t_ms:
            self._fault(event, "time goes back")
        super().event(event)
        match event:
            case Revealed():
                self._reveal(event)
            case DriveStarted():
                self._set_out(event)
            case DriveEnded():
                self._stand(event)
            case ActionStarted():
                self._start(event)
            case ActionEnded():
                self._end(event)
            case Planned():
                self._check(event, all(action.start_ms >= event.t_ms for action in event.actions), "starts in the past")
            case RobotLost():
                self._lost.add(event.robot)
            case MissionEnded() | MissionStarted():
                pass

    def _fault(self, event: MissionEvent, message: str) -> None:
        self.faults.append(f"{message}: {event}")

    def _check(self, event: MissionEvent, fine: bool, message: str) -> None:
        if not fine:
            self._fault(event, message)

    def _reveal(self, event: Revealed) -> None:
        known, truth = self._known.ravel(), self._grid.solid().cells.ravel()
        for i in range(0, len(event.runs), 3):
            start, length, code = event.runs[i : i + 3]
            run = slice(start, start + length)
            self._check(event, bool((known[run] == UNKNOWN).all()), "revealed twice")
            self._check(event, bool((truth[run] == code).all()), "not what is there")
            known[run] = code

    def _set_out(self, event: DriveStarted) -> None:
        name = event.robot
        self._check(event, self.carrier[name] is None, "a carried robot drives")
        self._check(event, name not in self._drives and name not in self._lost, "drives already, or is lost")
        self._check(event, self.cell[name] == event.cell, f"sets out from elsewhere than {self.cell[name]}")
        grid = Grid(cells=self._known, resolution_m=self._grid.resolution_m, terrains=self._grid.terrains)
        allowed = footprint_of(grid, self._kinds[name]).standable
        route = route_of(event.cell, event.steps)
        self._check(event, all(allowed[c.y, c.x] for c in route), "leads over cells it can't stand on")
        corners = [(Cell(a.x, b.y), Cell(b.x, a.y)) for a, b in pairwise(route)]
        self._check(event, all(allowed[c.y, c.x] for pair in corners for c in pair), "cuts a corner")
        self._drives[name] = event

    def _stand(self, event: DriveEnded) -> None:
        drive = self._drives.pop(event.robot)
        route = route_of(drive.cell, drive.steps)
        times = drive.t_ms + passing_times_ms(route, self._grid.resolution_m, self._kinds[event.robot].speed_mps)
        passed = {(cell, int(t)) for cell, t in zip(route, times, strict=True)}
        if event.robot in self._lost:
            self._check(event, event.cell in route, "is lost off its route")
        else:
            self._check(event, (event.cell, event.t_ms) in passed, "stands where it can't be at that time")
        self.cell[event.robot] = event.cell

    def _start(self, event: ActionStarted) -> None:
        action = event.action
        for name in action.robots:
            self._check(event, name not in self._running and name not in self._drives, f"{name} is busy or lost")
            self._check(event, name not in self._lost, f"{name} is lost")
            self._running[name] = event
        if action.carrier is None:
            return
        self._before[action.robot] = self.cell[action.robot], self.carrier[action.robot]
        host = self.cell[action.carrier]
        if action.name is ActionName.DOCK:
            load = sum(self.carrier[name] == action.carrier and name not in self._lost for name in self.carrier)
            self._check(event, load < self._kinds[action.carrier].capacity, "over capacity")
            self._check(event, self.cell[action.robot] == event.cell, "the rover is not there")
            self._check(event, self._close(action.robot, event.cell, action.carrier, host), "too far apart")
            self.cell[action.robot], self.carrier[action.robot] = None, action.carrier
        else:
            self._check(event, self.carrier[action.robot] == action.carrier, "is not aboard")
            self._check(event, self._close(action.robot, event.cell, action.carrier, host), "too far apart")
            self.cell[action.robot], self.carrier[action.robot] = event.cell, None

    def _close(self, rover: str, cell: Cell, carrier: str, host: Cell | None) -> bool:
        bodies_m = self._kinds[rover].radius_m + self._kinds[carrier].radius_m
        limit = bodies_m / self._grid.resolution_m + math.sqrt(2) + 1e-6
        return host is not None and math.dist(cell, host) <= limit

    def _end(self, event: ActionEnded) -> None:
        action = event.action
        if event.end is ActionEnd.BLOCKED:
            return
        for name in action.robots:
            started = self._running.pop(name, None)
            self._check(event, started is not None, f"{name} ends what it has not started")
        if event.end is ActionEnd.FAILED and action.carrier is not None:
            self.cell[action.robot], self.carrier[action.robot] = self._before[action.robot]
        if event.end is ActionEnd.DONE and action.carrier is not None and started is not None:
            kind = self._kinds[action.robot]
            took = kind.dock_ms if action.name is ActionName.DOCK else kind.undock_ms
            self._check(event, event.t_ms - started.t_ms == took, "takes another time")


def losses(times_ms: Mapping[str, int]) -> list[Fault]:
    """Return the faults by which robots are lost at these times."""
    return [Fault(kind=FaultKind.LOST, robot=name, at_ms=t_ms) for name, t_ms in sorted(times_ms.items())]


def run(
    grid: Grid,
    robots: Sequence[PlacedRobot],
    strategy: Strategy,
    *,
    kinds: Mapping[str, RobotType] | None = None,
    goal: Goal | None = None,
    time_ms: int = 3_600_000,
    planning_time: PlanningTime = PlanningTime.INSTANT,
    failures: Mapping[str, int] | None = None,
    observer: Observer | None = None,
    cancelled: Callable[[], bool] | None = None,
    coverage: float = 1.0,
    called_back: Callable[[], bool] = lambda: False,
) -> tuple[MissionEnded, Watcher]:
    """Run a mission in the simulator; all cells of the drawing except obstacles count as reachable area."""
    kinds = kinds_of() if kinds is None else kinds
    watcher = Watcher(grid, kinds, robots)
    order = MissionOrder(
        goal=Goal() if goal is None else goal,
        limits=MissionLimits(time_ms=time_ms, coverage=coverage),
        called_back=called_back,
        planning_time=planning_time,
        reachable=np.asarray((grid.cells != OBSTACLE) & (grid.cells != UNKNOWN)),
    )
    world = SimulatedWorld(grid, kinds, robots, losses(failures or {}))
    watchers = Observers([watcher] if observer is None else [watcher, observer])
    return MissionLoop(world, kinds, strategy, order, watchers).run(cancelled), watcher
