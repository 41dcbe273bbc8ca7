"""The closed loop: sense, analyse, decide, act, until the mission ends.

It knows a world and a strategy by their protocols only. It replans when news could change the plan: a target of the
plan is gone or a new one has shown up, a robot has run out of work while there is some, a way is blocked, a robot
could not do what it was told or is lost; never because time passes. Every plan is checked before it is followed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Bytes, Ints
from marsupial.maps.targets import Target
from marsupial.maps.territory import Territory
from marsupial.mission.carryover import carried_over, same_target, shifted
from marsupial.mission.executor import Executor
from marsupial.mission.observer import Observer
from marsupial.mission.survey import Survey, Surveyor
from marsupial.model.grid import UNKNOWN, Cell, Mask
from marsupial.model.mission import MapMeeting, MissionEnded, Planned, Revealed, RobotLost, Status
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import Goal, Limits, PlanningTime
from marsupial.model.situation import SituationGoal
from marsupial.model.strategy import Briefing, Decision, Strategy
from marsupial.model.world import News, RobotReport, World
from marsupial.native import native
from marsupial.planning.checker import check

LOOK_MS = 1000
"""Least simulated time between two looks at what newly seen cells mean for the plan."""

MAX_FRUITLESS = 5
"""Replannings at one and the same moment before a mission counts as stalled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """What a mission is asked to do and how it is measured.

    Parameters
    ----------
    reachable
        Cells (height, width) that count as the area to explore; None if the world's truth is not known.
    homes
        The cell each carrier has to come home to, by carrier; None for where they are at the start.
    """

    goal: Goal
    limits: Limits
    planning_time: PlanningTime = PlanningTime.INSTANT
    reachable: Mask | None = None
    homes: Mapping[str, Cell] | None = None


class Mission:
    """One mission of a team in a world.

    Parameters
    ----------
    kinds
        Robot types by name.
    """

    def __init__(
        self,
        world: World,
        kinds: Mapping[str, RobotType],
        strategy: Strategy,
        assignment: Assignment,
        observer: Observer,
    ) -> None:
        self._world = world
        self._kinds = kinds
        self._strategy = strategy
        self._assignment = assignment
        self._observer = observer
        self._territory = Territory(world.grid, tuple(kinds.values()))
        self._homes = homes_of(world.robots(), kinds) if assignment.homes is None else assignment.homes
        self._surveyor = Surveyor(self._territory, self._homes, assignment.goal)
        self._executor = Executor(world, self._surveyor.route, observer)
        self._ranges = {k.name: k.sensor_range_m / world.grid.resolution_m for k in kinds.values()}
        self._known: tuple[Target, ...] = ()
        self._meetings: dict[str, MapMeeting] = {}
        self._fresh = False
        self._looked_ms = -LOOK_MS
        self._revision = 0
        self._planned_ms = -1
        self._fruitless = 0
        self._refused = 0
        self._exploration_ms: int | None = None
        self._meanwhile: list[str] = []

    def run(self, cancelled: Callable[[], bool] | None = None) -> MissionEnded:
        """Run until the mission ends; `cancelled` is asked between events."""
        trigger = "start"
        self._take_in(self._world.advance(0))
        while True:
            if cancelled is not None and cancelled():
                return self._end(Status.CANCELLED, "cancelled")
            if trigger:
                ended = self._replan(trigger)
                if ended is not None:
                    return self._end(*ended)
            blocked = self._executor.start_due()
            if blocked:
                trigger = f"way blocked: {', '.join(blocked)}"
                continue
            if self._world.now_ms >= self._assignment.limits.time_ms:
                return self._end(Status.TIME_LIMIT, f"time limit of {self._world.now_ms / 1000:g} s reached")
            trigger = self._overtaken() or self._look(*self._wait())

    def _wait(self) -> tuple[News, tuple[Action, ...]]:
        until = self._assignment.limits.time_ms
        if self._fresh:
            until = min(until, max(self._world.now_ms, self._looked_ms + LOOK_MS))
        news = self._world.advance(until)
        return news, self._take_in(news)

    def _take_in(self, news: News) -> tuple[Action, ...]:
        """Enter what happened; return the actions that are done."""
        for name, indices in news.revealed:
            self._territory.reveal(indices)
            self._fresh = True
            runs = runs_of(indices, self._world.grid.cells.ravel())
            self._observer.event(Revealed(t_ms=news.t_ms, robot=name, runs=runs))
        self._executor.failed(name for name, _ in news.failed)
        for name, reason in news.lost:
            self._observer.event(RobotLost(t_ms=news.t_ms, robot=name, reason=reason))
        self._executor.lost(name for name, _ in news.lost)
        return self._executor.finished(news.finished)

    def _look(self, news: News, done: tuple[Action, ...]) -> str:
        """Return what asks for a new plan, or nothing."""
        setbacks = _setbacks(news)
        if setbacks:
            return setbacks
        explored = {action.place for action in done if action.name is ActionName.EXPLORE}
        self._known = tuple(target for target in self._known if target.name not in explored)
        if self._executor.idle:
            return "plan carried out"
        due = self._world.now_ms >= self._looked_ms + LOOK_MS
        free = bool(done) and self._unemployed({robot for action in done for robot in action.robots})
        if not (explored or (self._fresh and due) or free):
            return ""
        return self._compare(free)

    def _compare(self, free: bool) -> str:
        """Compare the targets there are now with those the plan knew; `free`: a robot has just run out of work."""
        self._fresh, self._looked_ms = False, self._world.now_ms
        targets = self._surveyor.targets(self._world.robots())
        self._note_explored(targets)
        wanted = {a.place for a in self._executor.remainder() if a.name is ActionName.EXPLORE}
        gone = [t.name for t in self._known if t.name in wanted and same_target(t, targets, self._ranges) is None]
        new = [t.name for t in targets if same_target(t, self._known, self._ranges) is None]
        words = [f"gone: {', '.join(gone)}"] if gone else []
        words += [f"new: {', '.join(new)}"] if new else []
        if not words and self._world.now_ms > self._planned_ms and free and self._left_out(targets, wanted):
            words.append("robot free")
        return "; ".join(words)

    def _left_out(self, targets: tuple[Target, ...], wanted: set[str]) -> bool:
        """Say whether there is a target that nobody is to explore."""
        served = [target for target in self._known if target.name in wanted]
        return any(same_target(target, served, self._ranges) is None for target in targets)

    def _unemployed(self, robots: set[str]) -> bool:
        return self._executor.unemployed(
            r.name for r in self._world.robots() if r.name in robots and r.carrier is None and not r.lost
        )

    def _replan(self, trigger: str) -> tuple[Status, str] | None:
        """Make a new plan and follow it; return how the mission ends if it does."""
        if all(robot.lost for robot in self._world.robots()):
            return Status.FAILED, "every robot is lost"
        survey = self._survey()
        self._note_explored(survey.targets)
        if not survey.targets and self._satisfied(survey):
            return Status.COMPLETE, "no reachable target is left" + wishes(self._assignment.goal)
        self._fruitless = self._fruitless + 1 if self._world.now_ms == self._planned_ms else 0
        if self._fruitless > MAX_FRUITLESS:
            return Status.STALLED, "replanning over and over takes nobody anywhere"
        return self._follow(trigger, survey, self._decide(survey))

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
        self._observer.planned(decision.report)
        return decision

    def _follow(self, trigger: str, survey: Survey, decision: Decision) -> tuple[Status, str] | None:
        # what a plan leaves of the goal is decided at a later replanning; that it can be carried out is what counts
        physical = replace(survey.situation, goal=SituationGoal())
        verdict = check(physical, decision.plan, targets=decision.plan.explored)
        if not verdict.valid:
            self._refused += 1
            return Status.FAILED, f"strategy {self._strategy.name} made an invalid plan: {verdict.violation}"
        stalled = not decision.plan.actions and not self._executor.running
        if self._assignment.planning_time is PlanningTime.CHARGED:
            self._adopt_late(trigger, survey, decision)
        else:
            self._adopt(trigger, survey, decision.plan)
        if stalled:
            return Status.STALLED, decision.report.detail or "the strategy knows nothing to do"
        return None

    def _adopt_late(self, trigger: str, survey: Survey, decision: Decision) -> None:
        """Let the time that planning took pass, then follow what of the plan still makes sense."""
        self._follow_old_plan_for(round(decision.report.wall_s * 1000))
        self._known = survey.targets
        self._meetings = {point.name: point for point in survey.meetings}
        later = self._survey(decision.plan.actions)
        physical = replace(later.situation, goal=SituationGoal())
        plan = carried_over(decision.plan.actions, physical, self._renamed(later))
        self._adopt(trigger, later, plan or Plan(actions=()))
        # what has turned up meanwhile is news to this plan
        self._known = tuple(t for t in later.targets if same_target(t, survey.targets, self._ranges) is not None)
        self._fresh = True

    def _overtaken(self) -> str:
        """Return what has happened while a plan was being made that asks for another one."""
        setbacks, self._meanwhile = self._meanwhile, []
        if setbacks:
            return "; ".join(setbacks)
        return "plan overtaken" if self._executor.idle else ""

    def _adopt(self, trigger: str, survey: Survey, plan: Plan) -> None:
        now = self._planned_ms = self._world.now_ms
        self._revision += 1
        self._known = survey.targets
        self._meetings = {point.name: point for point in survey.meetings}
        self._fresh, self._looked_ms = False, now
        plan = shifted(plan, now)
        self._observer.event(
            Planned(
                t_ms=now,
                revision=self._revision,
                trigger=trigger,
                targets=tuple(target.on_map() for target in survey.targets),
                meetings=survey.meetings,
                actions=plan.actions,
            )
        )
        self._executor.adopt(plan, survey.poses, self._revision)

    def _follow_old_plan_for(self, duration_ms: int) -> None:
        """Let time pass while robots drive on as planned; no new docking or undocking is begun."""
        until = min(self._world.now_ms + duration_ms, self._assignment.limits.time_ms)
        while self._world.now_ms < until:
            self._executor.start_due(drives_only=True)
            news = self._world.advance(until)
            self._take_in(news)
            self._meanwhile += filter(None, [_setbacks(news)])

    def _survey(self, planned: Iterable[Action] = ()) -> Survey:
        """Return the moment's survey; meeting points in use, or to be used by `planned`, are kept."""
        robots = self._world.robots()
        used = {action.place for action in (*self._executor.remainder(), *planned)}
        used |= set(self._executor.deployed_at.values())
        keep = [point for name, point in self._meetings.items() if name in used]
        return self._surveyor.survey(robots, self._world.now_ms, keep)

    def _renamed(self, survey: Survey) -> dict[str, str]:
        pairs = ((target.name, same_target(target, survey.targets, self._ranges)) for target in self._known)
        return {old: new.name for old, new in pairs if new is not None}

    def _note_explored(self, targets: Sequence[Target]) -> None:
        """Remember when the last target was gone, unless another one turns up."""
        if targets:
            self._exploration_ms = None
        elif self._exploration_ms is None:
            self._exploration_ms = self._world.now_ms

    def _satisfied(self, survey: Survey) -> bool:
        """Say whether the mission's wishes beyond exploring are met and nothing runs any more."""
        if self._executor.running:
            return False
        goal = survey.situation.goal
        robots = [robot for robot in self._world.robots() if not robot.lost]
        home = all(r.cell == self._homes[r.name] for r in robots if r.name in self._homes and r.cell is not None)
        aboard = all(r.carrier is not None for r in robots if self._kinds[r.type].role is Role.ROVER)
        return (aboard or not goal.recover_rovers) and (home or not goal.return_home)

    def _end(self, status: Status, reason: str) -> MissionEnded:
        robots = self._world.robots()
        targets = () if status is Status.COMPLETE else self._surveyor.targets(robots)
        area = self._world.grid.cell_area_m2
        known = self._world.grid.cells != UNKNOWN
        reachable = known if self._assignment.reachable is None else self._assignment.reachable
        ended = MissionEnded(
            t_ms=self._world.now_ms,
            status=status,
            reason=reason,
            exploration_ms=self._exploration_ms,
            explored_area_m2=round(int(np.count_nonzero(known & reachable)) * area, 6),
            reachable_area_m2=round(int(np.count_nonzero(reachable)) * area, 6),
            distance_m=tuple((r.name, round(self._world.distance_m(r.name), 3)) for r in robots),
            energy_j=energy_j(self._world, self._kinds),
            deployments=self._executor.deployments,
            retrievals=self._executor.retrievals,
            replans=self._revision,
            plans_valid=self._revision,
            plans_invalid=self._refused,
            aboard=tuple(r.name for r in robots if r.carrier is not None),
            remaining=self._surveyor.remaining(targets, f"still open when the mission ended: {reason}"),
        )
        self._observer.event(ended)
        return ended


def _setbacks(news: News) -> str:
    """Say who failed and who was lost, if anybody."""
    told = {"failed": news.failed, "lost": news.lost}
    return "; ".join(f"{word}: {', '.join(name for name, _ in who)}" for word, who in told.items() if who)


def homes_of(robots: Iterable[RobotReport], kinds: Mapping[str, RobotType]) -> dict[str, Cell]:
    """Return the cell of each carrier."""
    return {r.name: r.cell for r in robots if r.cell is not None and kinds[r.type].role is Role.CARRIER}


def wishes(goal: Goal) -> str:
    """Return what else a complete mission has done, to be added to its reason."""
    if goal.return_home:
        return ", the team is home"
    return ", all rovers are aboard" if goal.recover_rovers else ""


def energy_j(world: World, kinds: Mapping[str, RobotType]) -> tuple[tuple[str, float], ...]:
    """Return the energy in J that each robot has used so far."""

    def used(robot: RobotReport) -> float:
        energy, driving_s = kinds[robot.type].energy, world.driving_ms(robot.name) / 1000
        return round(energy.idle_w * (world.now_ms / 1000) + energy.drive_w * driving_s, 3)

    return tuple((robot.name, used(robot)) for robot in world.robots())


def runs_of(indices: Ints, cells: Bytes) -> tuple[int, ...]:
    """Return sorted row-major indices as flat runs (start, length, code) of equal neighbouring cells."""
    runs = np.empty((len(indices), 3), dtype=np.int64)
    count = _runs(indices, cells, runs)
    return tuple(runs[:count].ravel().tolist())


@native
def _runs(indices: Ints, cells: Bytes, runs: Ints) -> int:
    """Enter the runs (n, 3) of sorted row-major indices; return how many there are."""
    count = 0
    for index in indices:
        last = runs[count - 1]
        if count and index == last[0] + last[1] and cells[index] == last[2]:
            last[1] += 1
        else:
            runs[count, 0], runs[count, 1], runs[count, 2] = index, 1, cells[index]
            count += 1
    return count
