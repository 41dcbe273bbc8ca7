"""Replanning policies: when a mission makes a new plan, and from which survey.

The mission loop shows its policy all news (`update`) and asks whether it needs a new plan (`look`). The usual policy,
`OnNews`, replans when targets appear or disappear, a robot fails, or a robot runs out of work while targets are left.
"""

from collections.abc import Iterable, Sequence
from typing import Protocol

from marsupial.maps.lookout import Lookout, setbacks_in
from marsupial.maps.survey import Survey
from marsupial.maps.targets import Target
from marsupial.mission.carryover import same_targets
from marsupial.model import Action, ActionName, Cell, FrameShift, News, PlanProgress
from marsupial.model.mission import Cause, MapMeeting, Remaining, Status, Trigger, Triggers


class Replanning(Protocol):
    """Decides when to replan, which survey a plan is made from, and when exploring is over."""

    explored: str  # the reason of a mission that has explored everything
    exploration_ms: int | None  # when the last target disappeared, or None while some are left

    @property
    def wake_ms(self) -> int | None:
        """When to look again even if nothing happens, or None."""

    def update(self, news: News) -> None:
        """Update the map analysis with what robots have seen."""

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        """Return the triggers of a new plan after `news` and the end of the actions `done`."""

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        """Return the survey for a new plan or, with `late`, for fitting a finished plan; `keep` are meetings in use."""

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        """Note that the current plan was made from `survey`, or from `since` and then fitted to `survey`."""

    def route(self, kind: str, start: Cell, goal: Cell, heading: int | None, /) -> Sequence[Cell] | None:
        """Return the route of a robot type that faces `heading`, or None if there is none."""

    def remaining(self, status: Status, reason: str) -> tuple[Remaining, ...]:
        """Return the frontiers left at the end of the mission, and why."""


class OnNews(Lookout):
    """Replans when what robots have seen, done or failed to do could change the plan."""

    _known: tuple[Target, ...] = ()  # the targets that the current plan knows
    _planned_ms = -1

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        explores = [action for action in done if action.name is ActionName.EXPLORE]
        explorers = {action.robot for action in explores}
        for robot in self._world.robots() if explores else ():
            if robot.name in explorers and robot.cell is not None:
                self._looks.make(robot.type, robot.cell.y * self._world.grid.width + robot.cell.x)
        setbacks = setbacks_in(news)
        if setbacks:
            return setbacks
        # targets that disappear because they were explored as planned trigger nothing
        explored = {action.place for action in explores}
        if explored:
            self._known = tuple(target for target in self._known if target.name not in explored)
        if work.idle:
            return (Trigger(Cause.CARRIED_OUT),)
        freed = {robot for action in done for robot in action.robots}
        team = self._world.robots() if freed else ()
        on_ground = [r.name for r in team if r.name in freed and r.carrier is None and not r.lost]
        free = work.unemployed(on_ground)
        # comparing targets costs an analysis of the map, so compare only when something can have changed
        if not (explored or self._due or free):
            return ()
        return self._compare(work, free)

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        survey = self._surveyor.survey(self._world.robots(), self._world.now_ms, keep, self._targets())
        if not late:  # the next look handles cells seen during planning
            self._note_explored(left=bool(survey.targets))
        return survey

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        self._known = survey.targets
        if since is not None:  # the plan does not know targets that appeared while it was made
            self._known = tuple(t for t, was in self._paired(survey.targets, since.targets) if was is not None)
        self._looked(fresh=since is not None)
        self._planned_ms = self._world.now_ms

    def _move(self, shift: FrameShift) -> None:
        super()._move(shift)
        self._known = tuple(target.moved(shift) for target in self._known)

    def _compare(self, work: PlanProgress, free: bool) -> Triggers:
        """Compare the current targets with those that the plan knows; `free`: a robot has just run out of work."""
        self._looked()
        targets = self._targets()
        self._note_explored(left=bool(targets))
        wanted = {a.place for a in work.remainder() if a.name is ActionName.EXPLORE}
        planned = [target for target in self._known if target.name in wanted]
        gone = [target.name for target, now in self._paired(planned, targets) if now is None]
        new = [target.name for target, was in self._paired(targets, self._known) if was is None]
        changes = {Cause.GONE: gone, Cause.NEW: new}
        triggers = tuple(Trigger(cause, tuple(names)) for cause, names in changes.items() if names)
        # at the moment of planning itself the plan omits targets on purpose
        if triggers or not free or self._world.now_ms <= self._planned_ms:
            return triggers
        left_out = any(match is None for _, match in self._paired(targets, planned))
        return (Trigger(Cause.ROBOT_FREE),) if left_out else ()

    def _targets(self) -> tuple[Target, ...]:
        return self._surveyor.targets(self._world.robots())

    def _paired(self, targets: Sequence[Target], others: Sequence[Target]) -> Iterable[tuple[Target, Target | None]]:
        """Return each target with its match among `others`, or None."""
        ranges = {k.name: k.sensor_range_m / self._world.grid.resolution_m for k in self._kinds.values()}
        return zip(targets, same_targets(targets, others, ranges), strict=True)
