"""The growing map of a mission as policies of replanning watch it: when to look at it, and whether anything is left."""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.maps.survey import Surveyor
from marsupial.maps.territory import Territory
from marsupial.model.grid import Cell
from marsupial.model.mission import Cause, Remaining, Status, Trigger, Triggers
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal
from marsupial.model.world import News, World

LOOK_MS = 1000
"""Least simulated time between two looks at what newly seen cells mean."""


class Lookout:
    """What the policies of replanning have in common that know no more than what robots have seen.

    Attributes
    ----------
    exploration_ms
        Since when there has been nothing left to explore, or None.
    route
        Finds the way of a robot type over the known map (`Surveyor.route`).
    """

    explored = "no reachable target is left"

    def __init__(self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal) -> None:
        self._world = world
        self._territory = Territory(world.grid, tuple(kinds.values()))
        self._surveyor = Surveyor(self._territory, homes, goal)
        self._fresh = False
        self._looked_ms = -LOOK_MS
        self.exploration_ms: int | None = None
        self.route = self._surveyor.route

    @property
    def wake_ms(self) -> int | None:
        """When what was seen since the last look is to be looked at."""
        return self._looked_ms + LOOK_MS if self._fresh else None

    @property
    def _due(self) -> bool:
        """Whether what was seen since the last look is to be looked at now."""
        return self._fresh and self._world.now_ms >= self._looked_ms + LOOK_MS

    def take_in(self, news: News) -> None:
        """Enter the cells that were revealed in the map."""
        for _, indices in news.revealed:
            self._territory.reveal(indices)
            self._fresh = True

    def remaining(self, status: Status, reason: str) -> tuple[Remaining, ...]:
        """Return the targets that are left, and the frontiers that are none."""
        targets = () if status is Status.COMPLETE else self._surveyor.targets(self._world.robots())
        return self._surveyor.remaining(targets, reason)

    def _looked(self, *, fresh: bool = False) -> None:
        """Remember when the map was looked at; `fresh`: there already is more to see."""
        self._fresh, self._looked_ms = fresh, self._world.now_ms

    def _note_explored(self, *, left: bool) -> None:
        """Remember when the last target was gone, unless another one turns up."""
        if left:
            self.exploration_ms = None
        elif self.exploration_ms is None:
            self.exploration_ms = self._world.now_ms


def setbacks_in(news: News) -> Triggers:
    """Return who failed and who was lost."""
    told = {Cause.FAILED: news.failed, Cause.LOST: news.lost}
    return tuple(Trigger(cause, tuple(name for name, _ in who)) for cause, who in told.items() if who)
