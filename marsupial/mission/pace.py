"""A `World` around another one, which learns the speed of robots from drives that end later than planned.

Robots may be slower than they say: worn, on soft ground, held up at each start. `DRIVES` drives in a row that all took
clearly longer than planned lower the share of its speed at which a robot is planned for, to what these drives show; as
many that took clearly less time raise it again, but never above what the robot says itself. The mission loop learns of
it as of a speed that the robot reports (`News.slowed`). Drives on time change nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from marsupial.model import Cell, Grid, News, RobotReport, RobotType, World
from marsupial.model.bounds import BOUNDS
from marsupial.paths.routes import passing_times_ms

DRIVES = 3  # how many drives in a row have to be late, or early
LEAST_MS = 5000  # drives planned to take less are ignored: starting and reporting take a large part of them
LATE = 1.25  # how much longer than planned a late drive takes at least,
SLACK_MS = 2000  # besides this, for commands and reports on their way
LEAST_SHARE = 0.1  # robots that took longer were held up, and are not as slow as that


class _Drive(NamedTuple):
    """A drive that was late or early."""

    late: bool
    said_ms: int  # how long it should have taken at the speed that the robot says
    took_ms: int


class PacedWorld:
    """Forwards commands to another world, and returns its robots with the speeds learned."""

    def __init__(self, world: World, kinds: Mapping[str, RobotType]) -> None:
        self._world = world
        self._kinds = kinds
        self._shares: dict[str, float] = {}  # of the speed that a robot says, where it is below 1
        self._driving: dict[str, tuple[int, Sequence[Cell]]] = {}  # when drives began, and their routes
        self._rows: dict[str, list[_Drive]] = {}  # the last drives of a robot, if they were all late, or all early
        self.stop, self.dock, self.undock = world.stop, world.dock, world.undock
        self.distance_m, self.driving_ms, self.manoeuvres = world.distance_m, world.driving_ms, world.manoeuvres

    @property
    def grid(self) -> Grid:
        return self._world.grid

    @property
    def now_ms(self) -> int:
        return self._world.now_ms

    def robots(self) -> tuple[RobotReport, ...]:
        robots = self._world.robots()
        if not self._shares:
            return robots
        return tuple(replace(r, speed=self._speed(r)) if r.name in self._shares else r for r in robots)

    def drive(self, robot: str, route: Sequence[Cell]) -> None:
        self._driving[robot] = self.now_ms, route
        self._world.drive(robot, route)

    def advance(self, until_ms: int) -> News:
        news = self._world.advance(until_ms)
        if news.moved is not None:
            shift = news.moved
            self._driving = {
                name: (t_ms, [shift.cell(cell) for cell in route]) for name, (t_ms, route) in self._driving.items()
            }
        for name, _ in news.slowed:  # what a robot says itself comes first
            self._shares.pop(name, None)
            self._rows.pop(name, None)
        # drives that were not carried out as planned tell nothing
        for name, _ in (*news.failed, *news.declined, *news.lost, *news.slowed, *news.passages):
            self._driving.pop(name, None)
        ended = [name for name in news.finished if name in self._driving]
        learned = self._learn(ended, news.t_ms) if ended else ()
        return replace(news, slowed=(*news.slowed, *learned)) if learned else news

    def _speed(self, robot: RobotReport) -> float:
        return max(BOUNDS["speed_share"].least, round(robot.speed * self._shares.get(robot.name, 1.0), 2))

    def _learn(self, ended: Sequence[str], now_ms: int) -> tuple[tuple[str, float], ...]:
        """Note the drives that have ended; return the robots whose speed in plans changes, with that speed."""
        robots = {robot.name: robot for robot in self._world.robots()}
        learned = []
        for name in ended:
            before = self._speed(robots[name])
            began_ms, route = self._driving.pop(name)
            self._compare(robots[name], route, now_ms - began_ms)
            if (speed := self._speed(robots[name])) != before:
                learned.append((name, speed))
        return tuple(learned)

    def _compare(self, robot: RobotReport, route: Sequence[Cell], took_ms: int) -> None:
        """Compare a drive, which may have been stopped on its way, with the time planned for it."""
        kind, share = self._kinds[robot.type], self._shares.get(robot.name, 1.0)
        times = passing_times_ms(route, self.grid.resolution_m, kind.speed_mps * robot.speed, kind.diagonal)
        said_ms = int(times[route.index(robot.cell) if robot.cell in route else -1])
        planned_ms = said_ms / share
        if planned_ms < LEAST_MS:
            return
        late = took_ms > LATE * planned_ms + SLACK_MS
        early = share < 1.0 and planned_ms > LATE * took_ms + SLACK_MS
        row = [drive for drive in self._rows.pop(robot.name, ()) if drive.late == late]
        if not late and not early:
            return
        row.append(_Drive(late, said_ms, took_ms))
        if len(row) < DRIVES:
            self._rows[robot.name] = row
            return
        new = sum(drive.said_ms for drive in row) / max(1, sum(drive.took_ms for drive in row))
        self._shares.pop(robot.name, None)
        if new < 1.0:
            self._shares[robot.name] = max(LEAST_SHARE, new)
