"""Learns the speed of robots from drives that end later than planned.

Robots may be slower than they say: worn, on soft ground, held up at each start. `DRIVES` drives in a row that all took
clearly longer than planned lower the share of its speed at which a robot is planned for, to what these drives show; as
many that took clearly less time raise it again, but never above what the robot says itself. The mission loop learns of
it as of a speed that the robot reports (`News.slowed`). Drives on time change nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from marsupial.model import Cell, News, RobotReport, RobotType, World
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


class PaceFilter:
    """Replaces the speeds that the robots of a world say by those learned, in reports and news."""

    def __init__(self, world: World, kinds: Mapping[str, RobotType]) -> None:
        self._world = world
        self._kinds = {robot.name: kinds[robot.type] for robot in world.robots()}
        self._said = {robot.name: robot.speed for robot in world.robots()}  # the share of its speed that a robot says
        self._shares: dict[str, float] = {}  # of that, as learned, where it is below 1
        self._driving: dict[str, tuple[int, Sequence[Cell]]] = {}  # when drives began, and their routes
        self._rows: dict[str, list[_Drive]] = {}  # the last drives of a robot, if they were all late, or all early

    def reports(self, robots: tuple[RobotReport, ...]) -> tuple[RobotReport, ...]:
        """Return reports with the speeds learned."""
        if not self._shares:
            return robots
        return tuple(replace(r, speed=self._speed(r.name)) if r.name in self._shares else r for r in robots)

    def set_out(self, robot: str, route: Sequence[Cell]) -> None:
        """Note that a robot begins a drive now."""
        self._driving[robot] = self._world.now_ms, route

    def news(self, news: News) -> News:
        """Return news of a world with the speeds learned from it."""
        if news.moved is not None:
            shift = news.moved
            self._driving = {
                name: (t_ms, [shift.cell(cell) for cell in route]) for name, (t_ms, route) in self._driving.items()
            }
        for name, share in news.slowed:  # what a robot says itself comes first
            self._said[name] = share
            self._shares.pop(name, None)
            self._rows.pop(name, None)
        # drives that were not carried out as planned tell nothing, nor those whose ends may be known late
        ended = (name for name, _ in (*news.failed, *news.declined, *news.lost, *news.slowed, *news.passages))
        for name in (*ended, *news.out_of_contact):
            self._driving.pop(name, None)
        learned = tuple(self._learn(news)) if news.finished else ()
        return replace(news, slowed=(*news.slowed, *learned)) if learned else news

    def _speed(self, robot: str) -> float:
        return max(BOUNDS["speed_share"].least, round(self._said[robot] * self._shares.get(robot, 1.0), 2))

    def _learn(self, news: News) -> Iterator[tuple[str, float]]:
        """Note the drives that have ended; yield the robots whose speed in plans changes, with that speed."""
        for name in news.finished:
            if name not in self._driving:
                continue
            began_ms, route = self._driving.pop(name)
            took_ms = news.t_ms - began_ms
            usual = name not in self._shares and name not in self._rows
            if usual and took_ms <= LATE * LEAST_MS + SLACK_MS:  # most drives: neither late nor early
                continue
            before = self._speed(name)
            self._compare(name, self._driven(name, route), took_ms)
            if (speed := self._speed(name)) != before:
                yield name, speed

    def _driven(self, name: str, route: Sequence[Cell]) -> Sequence[Cell]:
        """Return the part of a route that a robot has driven, which may have been stopped."""
        cell = next(robot.cell for robot in self._world.robots() if robot.name == name)
        return route[: route.index(cell) + 1] if cell in route else route

    def _compare(self, name: str, route: Sequence[Cell], took_ms: int) -> None:
        """Compare a drive with the time planned for it."""
        kind, share = self._kinds[name], self._shares.get(name, 1.0)
        speed_mps = kind.speed_mps * self._said[name]
        said_ms = int(passing_times_ms(route, self._world.grid.resolution_m, speed_mps, kind.diagonal)[-1])
        planned_ms = said_ms / share
        if planned_ms < LEAST_MS:
            return
        late = took_ms > LATE * planned_ms + SLACK_MS
        early = share < 1.0 and planned_ms > LATE * took_ms + SLACK_MS
        row = [drive for drive in self._rows.pop(name, ()) if drive.late == late]
        if not late and not early:
            return
        row.append(_Drive(late, said_ms, took_ms))
        if len(row) < DRIVES:
            self._rows[name] = row
            return
        new = sum(drive.said_ms for drive in row) / max(1, sum(drive.took_ms for drive in row))
        self._shares.pop(name, None)
        if new < 1.0:
            self._shares[name] = max(LEAST_SHARE, new)
