"""The closed loop: sense, analyse, decide, act, until the mission ends.

It knows a world, a strategy and a policy of replanning by their protocols only. It replans when the policy asks for it
(by default: when news could change the plan), when a way is blocked or a plan was overtaken while it was being made;
never because time passes. Every plan is checked before it is followed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from marsupial.maps.footprint import fits
from marsupial.maps.lookout import setbacks_in
from marsupial.maps.survey import Survey
from marsupial.mission.carryover import carried_over, same_targets, shifted
from marsupial.mission.energy import energy_j
from marsupial.mission.executor import Executor
from marsupial.mission.goals import achieved, homes_of, unmet
from marsupial.mission.observer import Observer
from marsupial.mission.patience import Patience, Rounds, why_stalled
from marsupial.mission.recall import CarriersAlone, Recall, WayBack
from marsupial.mission.replanning import OnNews, Replanning
from marsupial.mission.runs import runs_of
from marsupial.mission.steady import SteadyWorld
from marsupial.model.frames import FrameShift
from marsupial.model.grid import UNKNOWN, Cell, Mask
from marsupial.model.mission import (
    Cause,
    Changed,
    FrameGrown,
    MissionEnded,
    Planned,
    Revealed,
    RobotLost,
    Status,
    Trigger,
    Triggers,
)
from marsupial.model.plan import Action, Plan
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal, MissionLimits, PlanningTime
from marsupial.model.situation import SituationGoal
from marsupial.model.strategy import Briefing, Decision, Strategy, checked_decision
from marsupial.model.world import News, World
from marsupial.planning.checker import check

MAX_FRUITLESS = 5
"""Replannings at one and the same moment before a mission counts as stalled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionOrder:
    """What a mission is asked to do and how it is measured.

    Parameters
    ----------
    reachable
        Cells (height, width) that count as the area to explore; None if the world's truth is not known.
    homes
        The cell each carrier has to come home to, by carrier; None for where they are at the start.
    waits
        Whether the mission waits, rather than be over, while there are robots that can't stand where they are on the
        known map: in worlds where others make the map, which may be late or wrong.
    """

    goal: Goal
    limits: MissionLimits
    planning_time: PlanningTime = PlanningTime.INSTANT
    reachable: Mask | None = None
    homes: Mapping[str, Cell] | None = None
    waits: bool = False


class MissionLoop:
    """One mission of a team in a world.

    Parameters
    ----------
    kinds
        Robot types by name.
    replanning
        When new plans are made, and from what; None for what the strategy brings along, or else `OnNews`.
    """

    def __init__(
        self,
        world: World,
        kinds: Mapping[str, RobotType],
        strategy: Strategy,
        order: MissionOrder,
        observer: Observer,
        replanning: Replanning | None = None,
    ) -> None:
        self._told = world
        self._world = world = SteadyWorld(world, kinds)
        self._kinds = kinds
        self._strategy = strategy
        self._order = order
        self._observer = observer
        self._homes = homes_of(world.robots(), kinds) if order.homes is None else order.homes
        self._reachable = order.reachable
        own: Callable[..., Replanning | None] = getattr(strategy, "replanning", lambda *_: None)
        circumstances = world, kinds, self._homes, order.goal
        with self._analysis():
            self._replanning = replanning or own(*circumstances) or OnNews(*circumstances)
        self._on_news = type(self._replanning) is OnNews
        self._executor = Executor(world, lambda *way: self._replanning.route(*way), observer)
        self._ranges = {k.name: k.sensor_range_m / world.grid.resolution_m for k in kinds.values()}
        self._followed: Survey | None = None
        self._revision = 0
        self._rounds = Rounds()
        self._recall: Recall | None = Recall(world, kinds, order.goal, order.limits.time_ms)  # None: called back
        self._planning_ms = self._busy_ms = 0
        self._patience = Patience(world, kinds, observer) if order.waits else None
        self._coming: tuple[Action, ...] = ()
        self._refused = 0
        self._meanwhile: Triggers = ()

    def run(self, cancelled: Callable[[], bool] | None = None) -> MissionEnded:
        """Run until the mission ends; `cancelled` is asked between events."""
        triggers: Triggers = (Trigger(Cause.START),)
        self._take_in(self._world.advance(0))
        while True:
            if cancelled is not None and cancelled():
                return self._end(Status.CANCELLED, "cancelled")
            if triggers:
                ended = self._replan_in_time(triggers)
                if ended is not None:
                    return self._end(*ended)
            if self._called_back():
                triggers = (Trigger(Cause.CALLED_BACK),)
                continue
            blocked = self._executor.start_due()
            if blocked:
                triggers = (Trigger(Cause.WAY_BLOCKED, blocked),)
                continue
            if self._world.now_ms >= self._order.limits.time_ms:
                return self._end(*self._out_of_time())
            triggers = self._overtaken() or self._look()

    def _called_back(self) -> bool:
        """Say whether the team is to get back from now on, as the time left is only just enough for that."""
        if self._recall is None or self._replanning.exploration_ms is not None:
            return False
        with self._analysis():
            if not self._recall.due(self._homes, self._executor, self._planning_ms):
                return False
            self._replanning = WayBack(self._world, self._kinds, self._homes, self._order.goal)
        self._recall = None
        return True

    def _go_on_without_rovers(self, survey: Survey) -> Survey:
        """Let carriers explore for the rest of the time, where the team need not be home; return what they know."""
        if self._order.goal.return_home or not self._on_news or isinstance(self._replanning, CarriersAlone):
            return survey
        self._replanning = CarriersAlone(self._world, self._kinds, self._homes, self._order.goal)
        return self._survey()

    def _out_of_time(self, why: str = "") -> tuple[Status, str]:
        """Return how the mission ends now that there is no time to explore on; `why` nothing more can be done."""
        left = unmet(self._order.goal, self._world.robots(), self._kinds, self._homes, self._executor.under_way)
        limit = f"time limit of {self._order.limits.time_ms / 1000:g} s"
        if self._world.now_ms >= self._order.limits.time_ms:
            return Status.TIME_LIMIT, ": ".join(filter(None, [f"{limit} reached", ", ".join(left)]))
        done = f", but {', '.join(left)}: {why}" if left else achieved(self._order.goal)
        return Status.TIME_LIMIT, f"called back before the {limit}{done}"

    def _look(self) -> Triggers:
        """Wait for something to happen; return what asks for a new plan."""
        until, wake_ms = self._order.limits.time_ms, self._replanning.wake_ms
        if self._recall is not None and self._replanning.exploration_ms is None:
            until = min(until, max(self._world.now_ms, self._recall.wake_ms(self._busy_ms)))
        if self._patience is not None and self._patience.waits:
            wake_ms = self._patience.wake_ms
        if wake_ms is not None:
            until = min(until, max(self._world.now_ms, wake_ms))
        news = self._world.advance(until)
        done = self._take_in(news)
        blocked = self._blocked_by(news)
        with self._analysis():
            triggers = blocked + self._replanning.look(news, done, self._executor)
        return triggers if self._patience is None else self._patience.after(triggers, news)

    def _blocked_by(self, news: News) -> Triggers:
        """Stop who drives where known cells have changed so that it can't; return that a new plan is needed, if so."""
        if not news.changed:
            return ()
        grid = self._world.grid
        names = self._executor.stop_blocked(lambda kind, cells: fits(grid, self._kinds[kind], *cells))
        return (Trigger(Cause.WAY_BLOCKED, names),) if names else ()

    def _take_in(self, news: News) -> tuple[Action, ...]:
        """Enter what happened; return the actions that are done."""
        if news.moved is not None:
            self._move(news.moved)
        with self._analysis():
            self._replanning.take_in(news)
        for kind, seen in ((Revealed, self._world.told.revealed), (Changed, self._world.told.changed)):
            for name, indices in seen:
                runs = runs_of(indices, self._told.grid.cells.ravel())
                self._observer.event(kind(t_ms=news.t_ms, robot=name, runs=runs))
        self._rounds.hear(news)
        self._executor.failed(name for name, _ in news.failed)
        for name, reason in news.lost:
            self._observer.event(RobotLost(t_ms=news.t_ms, robot=name, reason=reason))
        self._executor.lost(name for name, _ in news.lost)
        return self._executor.finished(news.finished)

    def _move(self, shift: FrameShift) -> None:
        """Call all that is remembered of the map as it is called now that its frame has grown."""
        grid = self._world.grid
        self._observer.event(
            FrameGrown(
                t_ms=self._world.now_ms,
                width=grid.width,
                height=grid.height,
                origin_m=grid.origin_m,
                shift=shift.by,
            )
        )
        self._homes = shift.cells(self._homes)
        if self._reachable is not None:
            self._reachable = shift.laid_out(self._reachable, fill=False)
        if self._followed is not None:
            self._followed = self._followed.moved(shift)
        self._coming = tuple(map(shift.action, self._coming))
        self._executor.move(shift)

    def _replan_in_time(self, triggers: Triggers) -> tuple[Status, str] | None:
        """Replan, unless nobody can stand where he is; return how the mission ends if it does."""
        if self._patience is None:
            return self._replan_on(triggers)
        return self._patience.over(self._replan_on(triggers)) if self._patience.ready() else None

    def _replan_on(self, triggers: Triggers) -> tuple[Status, str] | None:
        """Replan; where the mission would be over, once more without taking what flickers for obstacles."""
        ended = self._replan(triggers)
        while ended is not None and ended[0] is not Status.FAILED:
            news = self._world.release()
            if news is None:
                break
            with self._analysis():
                self._replanning.take_in(news)
            ended = self._replan(triggers)
        return ended

    def _replan(self, triggers: Triggers) -> tuple[Status, str] | None:
        """Make a new plan and follow it; return how the mission ends if it does."""
        if all(robot.lost for robot in self._world.robots()):
            return Status.FAILED, "every robot is lost"
        survey = self._survey()
        if self._satisfied(survey):
            if self._recall is None:
                survey = self._go_on_without_rovers(survey)
                if not survey.targets:
                    return self._out_of_time()
            elif self._replanning.exploration_ms is not None:
                return Status.COMPLETE, self._replanning.explored + achieved(self._order.goal)
        if self._rounds.begin(self._world.now_ms) > MAX_FRUITLESS:
            return self._stalled(survey, "replanning over and over takes nobody anywhere")
        return self._follow(triggers, survey, self._decide(survey))

    def _decide(self, survey: Survey) -> Decision:
        situation = survey.situation
        decision = self._strategy.decide(
            Briefing(
                situation=situation,
                previous=carried_over(self._executor.remainder(), situation, self._renamed(survey)),
                direct_ms=survey.direct_ms,
                unseen=survey.unseen,
                connects=survey.connects,
                deployed_at={
                    rover: name
                    for rover, name in self._executor.deployed_at.items()
                    if name in situation.meetings and rover in situation.robot_by_name
                },
            )
        )
        checked_decision(self._strategy.name, decision)
        self._observer.planned(decision.report)
        if self._order.planning_time is PlanningTime.CHARGED:
            self._planning_ms = round(decision.report.wall_s * 1000)
        return decision

    def _follow(self, triggers: Triggers, survey: Survey, decision: Decision) -> tuple[Status, str] | None:
        # what a plan leaves of the goal is decided at a later replanning; that it can be carried out is what counts
        physical = replace(survey.situation, goal=SituationGoal())
        verdict = check(physical, decision.plan, targets=decision.plan.explored)
        if not verdict.valid:
            self._refused += 1
            return Status.FAILED, f"strategy {self._strategy.name} made an invalid plan: {verdict.violation}"
        stalled = not decision.plan.actions and not self._executor.running
        if self._order.planning_time is PlanningTime.CHARGED:
            self._adopt_late(triggers, survey, decision)
        else:
            self._adopt(triggers, survey, decision.plan)
        if stalled:
            return self._stalled(survey, decision.report.detail or "the strategy knows nothing to do")
        return None

    def _stalled(self, survey: Survey, told: str) -> tuple[Status, str]:
        """Return how the mission ends of which nobody knows how it could go on."""
        why = why_stalled(survey, self._world, told)
        return self._out_of_time(why) if self._recall is None else (Status.STALLED, why)

    def _adopt_late(self, triggers: Triggers, survey: Survey, decision: Decision) -> None:
        """Let the time that planning took pass, then follow what of the plan still makes sense."""
        self._followed, self._coming = survey, decision.plan.actions
        self._follow_old_plan_for(round(decision.report.wall_s * 1000))
        survey, coming = self._followed, self._coming
        later = self._survey(coming, late=True)
        physical = replace(later.situation, goal=SituationGoal())
        plan = carried_over(coming, physical, self._renamed(later))
        self._adopt(triggers, later, plan or Plan(actions=()))
        self._replanning.follow(later, since=survey)

    def _overtaken(self) -> Triggers:
        """Return what has happened while a plan was being made that asks for another one."""
        setbacks, self._meanwhile = self._meanwhile, ()
        waits = self._patience is not None and self._patience.waits
        if not setbacks and self._executor.idle and not waits:
            return (Trigger(Cause.OVERTAKEN),)
        return setbacks

    def _adopt(self, triggers: Triggers, survey: Survey, plan: Plan) -> None:
        now = self._world.now_ms
        self._rounds.planned(now)
        self._revision += 1
        self._followed = survey
        self._replanning.follow(survey)
        plan = shifted(plan, now)
        self._busy_ms = plan.makespan_ms
        self._observer.event(
            Planned(
                t_ms=now,
                revision=self._revision,
                trigger=triggers,
                targets=tuple(target.on_map() for target in survey.targets),
                meetings=survey.meetings,
                actions=plan.actions,
            )
        )
        self._executor.adopt(plan, survey.poses, self._revision)

    def _follow_old_plan_for(self, duration_ms: int) -> None:
        """Let time pass while robots drive on as planned; no new docking or undocking is begun."""
        until = min(self._world.now_ms + duration_ms, self._order.limits.time_ms)
        while self._world.now_ms < until:
            self._executor.start_due(drives_only=True)
            news = self._world.advance(until)
            self._take_in(news)
            self._meanwhile += self._blocked_by(news) + setbacks_in(news)

    def _survey(self, planned: Iterable[Action] = (), *, late: bool = False) -> Survey:
        """Return the moment's survey; meeting points in use, or to be used by `planned`, are kept."""
        used = {action.place for action in (*self._executor.remainder(), *planned)}
        used |= set(self._executor.deployed_at.values())
        meetings = () if self._followed is None else self._followed.meetings
        keep = [point for point in meetings if point.name in used]
        with self._analysis():
            return self._replanning.survey(self._executor, keep, late=late)

    @contextmanager
    def _analysis(self) -> Iterator[None]:
        self._observer.analysing()
        try:
            yield
        finally:
            self._observer.analysed()

    def _renamed(self, survey: Survey) -> dict[str, str]:
        known = () if self._followed is None else self._followed.targets
        now = same_targets(known, survey.targets, self._ranges)
        return {old.name: new.name for old, new in zip(known, now, strict=True) if new is not None}

    def _satisfied(self, survey: Survey) -> bool:
        """Say whether the mission's goal beyond exploring is met and nothing runs any more."""
        if self._executor.running:
            return False
        return not unmet(survey.situation.goal, self._world.robots(), self._kinds, self._homes)

    def _end(self, status: Status, reason: str) -> MissionEnded:
        robots = self._world.robots()
        area = self._told.grid.cell_area_m2
        known = self._told.grid.cells != UNKNOWN
        reachable = known if self._reachable is None else self._reachable
        ended = MissionEnded(
            t_ms=self._world.now_ms,
            status=status,
            reason=reason,
            exploration_ms=self._replanning.exploration_ms,
            explored_area_m2=round(int(np.count_nonzero(known & reachable)) * area, 6),
            reachable_area_m2=round(int(np.count_nonzero(reachable)) * area, 6),
            distance_m=tuple((r.name, round(self._world.distance_m(r.name), 3)) for r in robots),
            energy_j=energy_j(self._world, self._kinds),
            deployments=self._executor.deployments.deployed,
            retrievals=self._executor.deployments.retrieved,
            replans=self._revision,
            plans_valid=self._revision,
            plans_invalid=self._refused,
            aboard=tuple(r.name for r in robots if r.carrier is not None and r.name not in self._executor.under_way),
            remaining=self._replanning.remaining(status, f"still open when the mission ended: {reason}")
            + self._world.remaining(),
        )
        self._observer.event(ended)
        return ended
