"""When a mission makes a new plan, and from what.

The mission loop asks a policy of replanning after whatever happens. The usual one knows what the robots have seen and
asks for a new plan when that could change the plan; the clairvoyant has another one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from marsupial.maps.lookout import Lookout, setbacks_in
from marsupial.maps.survey import Survey
from marsupial.maps.targets import Target
from marsupial.mission.carryover import same_targets
from marsupial.model.frames import FrameShift
from marsupial.model.grid import Cell
from marsupial.model.mission import Cause, MapMeeting, Remaining, Status, Trigger, Triggers
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal
from marsupial.model.strategy import PlanProgress
from marsupial.model.world import News, World


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


class OnNews(Lookout):
    """Asks for a new plan when what the robots have seen, done or failed to do could change the plan."""

    def __init__(self, world: World, kinds: Mapping[str, RobotType], homes: Mapping[str, Cell], goal: Goal) -> None:
        super().__init__(world, kinds, homes, goal)
        self._ranges = {k.name: k.sensor_range_m / world.grid.resolution_m for k in kinds.values()}
        self._known: tuple[Target, ...] = ()
        self._planned_ms = -1

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        """Return the setbacks, or how the targets there are differ from those the plan knows."""
        explores = [action for action in done if action.name is ActionName.EXPLORE]
        explored = {action.place for action in explores}
        if explores:
            self._note_looks({action.robot for action in explores})
        setbacks = setbacks_in(news)
        if setbacks:
            return setbacks
        if explored:
            self._known = tuple(target for target in self._known if target.name not in explored)
        if work.idle:
            return (Trigger(Cause.CARRIED_OUT),)
        free = bool(done) and self._unemployed({robot for action in done for robot in action.robots}, work)
        if not (explored or self._due or free):
            return ()
        return self._compare(work, free)

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        """Return what the map known so far means for the team; what was seen while planning is for the next look."""
        survey = self._surveyor.survey(self._world.robots(), self._world.now_ms, keep, self._targets())
        if not late:
            self._note_explored(left=bool(survey.targets))
        return survey

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        """Hold the targets that the plan knows."""
        self._known = survey.targets
        if since is not None:
            self._known = tuple(t for t, was in self._paired(survey.targets, since.targets) if was is not None)
        self._looked(fresh=since is not None)
        self._planned_ms = self._world.now_ms

    def _move(self, shift: FrameShift) -> None:
        super()._move(shift)
        self._known = tuple(target.moved(shift) for target in self._known)

    def _compare(self, work: PlanProgress, free: bool) -> Triggers:
        """Compare the targets there are now with those the plan knew; `free`: a robot has just run out of work."""
        self._looked()
        targets = self._targets()
        self._note_explored(left=bool(targets))
        wanted = {a.place for a in work.remainder() if a.name is ActionName.EXPLORE}
        meant = [target for target in self._known if target.name in wanted]
        gone = [target.name for target, now in self._paired(meant, targets) if now is None]
        new = [target.name for target, was in self._paired(targets, self._known) if was is None]
        told = {Cause.GONE: gone, Cause.NEW: new}
        triggers = tuple(Trigger(cause, tuple(names)) for cause, names in told.items() if names)
        if not triggers and self._world.now_ms > self._planned_ms and free and self._left_out(targets, wanted):
            return (Trigger(Cause.ROBOT_FREE),)
        return triggers

    def _note_looks(self, explorers: set[str]) -> None:
        """Remember from where robots have looked that have just explored a target."""
        for robot in self._world.robots():
            if robot.name in explorers and robot.cell is not None:
                self._looks.make(robot.type, robot.cell.y * self._world.grid.width + robot.cell.x)

    def _targets(self) -> tuple[Target, ...]:
        """Return the targets there are now."""
        return self._surveyor.targets(self._world.robots())

    def _left_out(self, targets: tuple[Target, ...], wanted: set[str]) -> bool:
        """Say whether there is a target that no robot is to explore."""
        served = [target for target in self._known if target.name in wanted]
        return any(other is None for _, other in self._paired(targets, served))

    def _paired(self, targets: Sequence[Target], others: Sequence[Target]) -> Iterable[tuple[Target, Target | None]]:
        """Return each target with the one of `others` that it has turned into, or None."""
        return zip(targets, same_targets(targets, others, self._ranges), strict=True)

    def _unemployed(self, robots: set[str], work: PlanProgress) -> bool:
        return work.unemployed(
            r.name for r in self._world.robots() if r.name in robots and r.carrier is None and not r.lost
        )
