"""The growing map of a mission as replanning policies watch it: when to survey it, and whether anything is left."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.landings import Looks
from marsupial.maps.survey import Surveyor
from marsupial.maps.territory import Territory
from marsupial.model import Cause, Cell, FrameShift, Goal, News, Remaining, RobotType, Status, Trigger, Triggers, World

LOOK_MS = 1000  # least simulated time between two surveys because of newly seen cells


class Lookout:
    """Base of the replanning policies that know only what the robots have seen."""

    explored = "no reachable target is left"

    def __init__(self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal) -> None:
        self._world = world
        self._kinds = kinds
        self._homes = homes
        self._goal = goal
        self._fresh = False
        self._looked_ms = -LOOK_MS
        self.exploration_ms: int | None = None  # when the last target disappeared, or None while some are left
        self._looks = Looks()
        self._analysed: Surveyor | None = self._analysis()
        self._coming: dict[str, list[Ints]] = {}  # revealed cells by robot: one late update costs less than many

    def _analysis(self) -> Surveyor:
        territory = Territory(self._world.grid, tuple(self._kinds.values()))
        return Surveyor(territory, self._homes, self._goal, self._looks)

    @property
    def _surveyor(self) -> Surveyor:
        """The analysis of the map, updated by what was revealed; a new one if known cells changed."""
        if self._analysed is None:
            self._analysed = self._analysis()
        else:
            for parts in self._coming.values():
                self._analysed.territory.reveal(np.sort(np.concatenate(parts)))
        self._coming.clear()
        return self._analysed

    def route(self, kind: str, start: Cell, goal: Cell, heading: int | None = None) -> tuple[Cell, ...] | None:
        return self._surveyor.route(kind, start, goal, heading)

    @property
    def wake_ms(self) -> int | None:
        # newly seen cells are surveyed together, `LOOK_MS` after the last survey
        return self._looked_ms + LOOK_MS if self._fresh else None

    @property
    def _due(self) -> bool:
        return self._fresh and self._world.now_ms >= self._looked_ms + LOOK_MS

    def update(self, news: News) -> None:
        # an analysis is valid only while known cells, the frame and zones do not change
        if news.moved is not None:
            self._move(news.moved)
        if news.moved is not None or news.changed or news.zones:
            self._analysed = None
            self._fresh = True
        kinds = {robot.name: robot.type for robot in self._world.robots()} if news.stops else {}
        for name, cells in news.stops:
            for cell in cells:
                self._looks.make(kinds[name], cell.y * self._world.grid.width + cell.x)
        for name, indices in news.revealed:
            self._coming.setdefault(name, []).append(indices)
            self._fresh = True

    def _move(self, shift: FrameShift) -> None:
        self._homes = shift.cells(self._homes)
        self._looks = self._looks.moved(shift)

    def remaining(self, status: Status, reason: str) -> tuple[Remaining, ...]:
        all_explored = status is Status.COMPLETE and self.exploration_ms is not None
        # of rovers out of contact too
        robots = [replace(robot, away=None) for robot in self._world.robots()]
        targets = () if all_explored else self._surveyor.targets(robots)
        return self._surveyor.remaining(targets, reason, robots)

    def _looked(self, *, fresh: bool = False) -> None:
        """Note the time of a survey; `fresh` if more has been seen since."""
        self._fresh, self._looked_ms = fresh, self._world.now_ms

    def _note_explored(self, *, left: bool) -> None:
        robots = self._world.robots()
        # the targets of rovers out of contact are left, too
        if left or (any(robot.away and not robot.lost for robot in robots) and self._surveyor.anything_left(robots)):
            self.exploration_ms = None
        elif self.exploration_ms is None:
            self.exploration_ms = self._world.now_ms


def setbacks_in(news: News) -> Triggers:
    """Return the triggers for robots that failed, were lost, returned, changed speed, lack charge or are heard."""
    setbacks = {
        Cause.FAILED: [name for name, _ in (*news.failed, *news.declined)],
        Cause.LOST: [name for name, _ in news.lost],
        Cause.RETURNED: news.returned,
        Cause.SPEED: [name for name, _ in news.slowed],
        Cause.DRAINED: news.drained,
        Cause.CONTACT: news.in_contact,
    }
    return tuple(Trigger(cause, tuple(names)) for cause, names in setbacks.items() if names)
