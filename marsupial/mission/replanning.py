"""When a mission makes a new plan, and from what.

The mission loop asks a policy of replanning after whatever happens. The usual one knows what the robots have seen and
asks for a new plan when that could change the plan; the clairvoyant has another one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.targets import Target
from marsupial.maps.territory import Territory
from marsupial.mission.carryover import same_target
from marsupial.model.grid import Cell
from marsupial.model.mission import Cause, MapMeeting, Remaining, Status, Trigger, Triggers
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal
from marsupial.model.strategy import PlanProgress
from marsupial.model.world import News, World

LOOK_MS = 1000
"""Least simulated time between two looks at what newly seen cells mean for the plan."""


class Replanning(Protocol):
    """What counts as news, when a new plan is needed, what it is made from, and when exploring is over."""

    @property
    def explored(self) -> str:
        """What is said of a mission that has explored everything."""

    @property
    def exploration_ms(self) -> int | None:
        """Since when there has been nothing left to explore, or None."""

    @property
    def wake_ms(self) -> int | None:
        """When to look again even if nothing happens, or None."""

    def take_in(self, news: News) -> None:
        """Take in what the robots have seen."""

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        """Return what asks for a new plan, if anything, now that these actions are done."""

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        """Return what a new plan is made from, or fitted to if `late`; the meeting points `keep` are in use."""

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        """Take in that a plan made from `survey` is followed; what has turned up `since` another one is news to it."""

    def route(self, kind: str, start: Cell, goal: Cell, heading: int | None, /) -> Sequence[Cell] | None:
        """Return the route of a robot type that faces `heading` at first, or None where there is none."""

    def remaining(self, status: Status, reason: str) -> tuple[Remaining, ...]:
        """Return every frontier that is left at the end of the mission, and why."""


class OnNews:
    """Asks for a new plan when what the robots have seen, done or failed to do could change the plan."""

    explored = "no reachable target is left"

    def __init__(self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal) -> None:
        self._world = world
        self._territory = Territory(world.grid, tuple(kinds.values()))
        self._surveyor = Surveyor(self._territory, homes, goal)
        self._ranges = {k.name: k.sensor_range_m / world.grid.resolution_m for k in kinds.values()}
        self._known: tuple[Target, ...] = ()
        self._fresh = False
        self._looked_ms = -LOOK_MS
        self._planned_ms = -1
        self.exploration_ms: int | None = None
        self.route = self._surveyor.route

    @property
    def wake_ms(self) -> int | None:
        """When what was seen since the last look is to be looked at."""
        return self._looked_ms + LOOK_MS if self._fresh else None

    def take_in(self, news: News) -> None:
        """Enter the cells that were revealed in the map."""
        for _, indices in news.revealed:
            self._territory.reveal(indices)
            self._fresh = True

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        """Return the setbacks, or how the targets there are differ from those the plan knows."""
        setbacks = setbacks_in(news)
        if setbacks:
            return setbacks
        explored = {action.place for action in done if action.name is ActionName.EXPLORE}
        self._known = tuple(target for target in self._known if target.name not in explored)
        if work.idle:
            return (Trigger(Cause.CARRIED_OUT),)
        due = self._world.now_ms >= self._looked_ms + LOOK_MS
        free = bool(done) and self._unemployed({robot for action in done for robot in action.robots}, work)
        if not (explored or (self._fresh and due) or free):
            return ()
        return self._compare(work, free)

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        """Return what the map known so far means for the team; what was seen while planning is for the next look."""
        survey = self._surveyor.survey(self._world.robots(), self._world.now_ms, keep)
        if not late:
            self._note_explored(survey.targets)
        return survey

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        """Hold the targets that the plan knows."""
        self._known = survey.targets
        if since is not None:
            self._known = tuple(t for t in survey.targets if same_target(t, since.targets, self._ranges) is not None)
        self._fresh = since is not None
        self._looked_ms = self._planned_ms = self._world.now_ms

    def remaining(self, status: Status, reason: str) -> tuple[Remaining, ...]:
        """Return the targets that are left, and the frontiers that are none."""
        targets = () if status is Status.COMPLETE else self._surveyor.targets(self._world.robots())
        return self._surveyor.remaining(targets, reason)

    def _compare(self, work: PlanProgress, free: bool) -> Triggers:
        """Compare the targets there are now with those the plan knew; `free`: a robot has just run out of work."""
        self._fresh, self._looked_ms = False, self._world.now_ms
        targets = self._surveyor.targets(self._world.robots())
        self._note_explored(targets)
        wanted = {a.place for a in work.remainder() if a.name is ActionName.EXPLORE}
        gone = [t.name for t in self._known if t.name in wanted and same_target(t, targets, self._ranges) is None]
        new = [t.name for t in targets if same_target(t, self._known, self._ranges) is None]
        told = {Cause.GONE: gone, Cause.NEW: new}
        triggers = tuple(Trigger(cause, tuple(names)) for cause, names in told.items() if names)
        if not triggers and self._world.now_ms > self._planned_ms and free and self._left_out(targets, wanted):
            return (Trigger(Cause.ROBOT_FREE),)
        return triggers

    def _left_out(self, targets: tuple[Target, ...], wanted: set[str]) -> bool:
        """Say whether there is a target that no robot is to explore."""
        served = [target for target in self._known if target.name in wanted]
        return any(same_target(target, served, self._ranges) is None for target in targets)

    def _unemployed(self, robots: set[str], work: PlanProgress) -> bool:
        return work.unemployed(
            r.name for r in self._world.robots() if r.name in robots and r.carrier is None and not r.lost
        )

    def _note_explored(self, targets: Sequence[Target]) -> None:
        """Remember when the last target was gone, unless another one turns up."""
        if targets:
            self.exploration_ms = None
        elif self.exploration_ms is None:
            self.exploration_ms = self._world.now_ms


def setbacks_in(news: News) -> Triggers:
    """Return who failed and who was lost."""
    told = {Cause.FAILED: news.failed, Cause.LOST: news.lost}
    return tuple(Trigger(cause, tuple(name for name, _ in who)) for cause, who in told.items() if who)
