"""Knows of rovers out of contact only what was agreed with them.

A rover out of contact carries out what it was told last (`Executor.part`), so it is known where and when it will wait:
it is reported to be there. What happens to it becomes known once it is in contact again. One that is not in contact
though a carrier is near the place, `LATE_MS` after the time, counts as lost until then.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from marsupial.maps.territory import contact_range_cells
from marsupial.model import Cell, FrameShift, News, RobotReport, RobotType, Role, World
from marsupial.model.world import HeldNews, apart
from marsupial.paths.routes import passing_times_ms

LATE_MS = 60_000  # how much later than expected a rover may come: robots wait for each other

MISSING = "is not where it was expected"  # the reason of a loss


class RadioFilter:
    """Replaces what a world reports of rovers out of contact by what is expected of them."""

    def __init__(self, world: World, kinds: Mapping[str, RobotType]) -> None:
        self._world, self._kinds = world, kinds
        self._expected: dict[str, RobotReport] = {}  # of rovers out of contact
        self._held = HeldNews()
        self._stops: dict[str, list[Cell]] = {}  # where their drives have ended
        self.heard: set[str] = set()  # rovers that were out of contact, and have told all since the map last changed

    @property
    def awaits(self) -> bool:
        """Whether a rover out of contact may still come to where it is expected."""
        now_ms = self._world.now_ms
        return any(not one.lost and now_ms < one.free_at_ms + LATE_MS for one in self._expected.values())

    def reports(self, robots: tuple[RobotReport, ...]) -> tuple[RobotReport, ...]:
        """Return reports with rovers out of contact where they are expected."""
        if not self._expected:
            return robots
        return tuple(self._waiting(self._expected[r.name]) if r.name in self._expected else r for r in robots)

    def expect(self, robot: RobotReport, routes: Iterable[Sequence[Cell]], explores: tuple[Cell, ...]) -> RobotReport:
        """Note that a rover out of contact drives these routes and explores these cells; return where it will wait."""
        kind, cell = self._kinds[robot.type], robot.cell
        wait_ms = max(robot.free_at_ms, self._world.now_ms)
        begun_ms, speed_mps = wait_ms, kind.speed_mps * robot.speed
        for route in routes:
            wait_ms += int(passing_times_ms(route, self._world.grid.resolution_m, speed_mps, kind.diagonal)[-1])
            cell = route[-1]
        used_j = kind.power_w(driving=True, speed=robot.speed) * (wait_ms - begun_ms) / 1000
        charge = _less(robot, kind, used_j)
        expected = replace(robot, cell=cell, free_at_ms=wait_ms, heading=None, charge=charge, away=explores)
        self._expected[robot.name] = expected
        if explores:  # it will have something to tell
            self.heard.discard(robot.name)
        return expected

    def until(self, until_ms: int) -> int:
        """Return until when time may pass at most."""
        late = (one.free_at_ms + LATE_MS for one in self._expected.values() if not one.lost)
        return min([until_ms, *(at_ms for at_ms in late if at_ms > self._world.now_ms)])

    def news(self, news: News) -> News:
        """Return news without what happens to rovers out of contact, and with what happened to those that were."""
        if news.moved is not None:
            self._move(news.moved)
        return self._known(news) if self._expected else news

    def note_seen(self, news: News) -> None:
        """Note from news of the known map who has told all since it last changed."""
        if news.revealed or news.changed or news.zones:
            self.heard.clear()
        self.heard.update(news.in_contact)

    def _move(self, shift: FrameShift) -> None:
        """Re-index all cells after the frame grew."""
        for name, one in self._expected.items():
            assert one.cell is not None, "rovers aboard are in contact"
            self._expected[name] = replace(one, cell=shift.cell(one.cell), away=tuple(map(shift.cell, one.away or ())))
        self._stops = {name: list(map(shift.cell, cells)) for name, cells in self._stops.items()}

    def _waiting(self, robot: RobotReport) -> RobotReport:
        """Return the report of a rover out of contact at the present time."""
        waits_ms = max(0, self._world.now_ms - robot.free_at_ms)
        kind = self._kinds[robot.type]
        charge = _less(robot, kind, kind.power_w(driving=False) * waits_ms / 1000)
        return replace(robot, free_at_ms=robot.free_at_ms + waits_ms, charge=charge)

    def _known(self, news: News) -> News:
        news, unheard = apart(news, self._expected)
        now = {robot.name: robot for robot in self._world.robots()}
        for name in unheard.finished:
            if (cell := now[name].cell) is not None:
                self._stops.setdefault(name, []).append(cell)
        heard = {name: self._expected.pop(name) for name in news.in_contact if name in self._expected}
        late = self._held.told(unheard, self._expected)
        missing = [name for name, one in self._expected.items() if not one.lost and self._is_missing(one, now)]
        for name in missing:
            self._expected[name] = replace(self._expected[name], lost=True, returns=now[name].returns)
        reasons, speeds = dict(late.lost), dict(late.slowed)
        lost = [(name, reasons[name]) for name, one in heard.items() if now[name].lost and not one.lost]
        lost += [(name, MISSING) for name in missing]
        return replace(
            news,
            lost=(*news.lost, *lost),
            returned=(*news.returned, *(name for name, one in heard.items() if one.lost and not now[name].lost)),
            slowed=(*news.slowed, *((name, speeds[name]) for name in heard if name in speeds)),
            stops=tuple((name, tuple(self._stops.pop(name))) for name in heard if name in self._stops),
        )

    def _is_missing(self, expected: RobotReport, now: Mapping[str, RobotReport]) -> bool:
        """Return whether a carrier stands near the place where a rover out of contact should be by now."""
        if self._world.now_ms < expected.free_at_ms + LATE_MS or expected.cell is None:
            return False
        limit = contact_range_cells(self._kinds[expected.type], self._kinds.values(), self._world.grid.resolution_m)
        carriers = (robot for robot in now.values() if self._kinds[robot.type].role is Role.CARRIER and not robot.lost)
        # a carrier that drives is still on its way to the cell that it reports
        there = (robot.cell for robot in carriers if robot.cell is not None and robot.free_at_ms <= self._world.now_ms)
        return any(math.dist(cell, expected.cell) <= limit for cell in there)


def _less(robot: RobotReport, kind: RobotType, used_j: float) -> float | None:
    """Return the share of charge that is left in the battery of a robot."""
    if kind.battery is None:
        return robot.charge
    return max(0.0, (1.0 if robot.charge is None else robot.charge) - used_j / kind.battery.capacity_j)
