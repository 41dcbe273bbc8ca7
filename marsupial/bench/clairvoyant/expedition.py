"""Carries a plan out in a world whose map is known to who made it, and then brings the rovers back.

As in any mission the robots see what there is to see from where they are; but nobody looks at what they report, until
all of the reachable area is known. Then a greedy plan does what the mission asks for besides exploring.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from marsupial.maps.territory import Territory
from marsupial.mission.carryover import shifted
from marsupial.mission.executor import Executor
from marsupial.mission.loop import Assignment, energy_j, homes_of, runs_of, wishes
from marsupial.mission.observer import Observer
from marsupial.mission.survey import Poses, Surveyor
from marsupial.model.grid import Grid
from marsupial.model.mission import MapMeeting, MapTarget, MissionEnded, Planned, Revealed, Status
from marsupial.model.plan import Plan
from marsupial.model.robots import RobotType, Role
from marsupial.model.world import News, World
from marsupial.planning.list_scheduling.greedy import serve


class Expedition:
    """One mission with a plan made beforehand.

    Parameters
    ----------
    truth
        The whole map.
    kinds
        Robot types by name.
    assignment
        Its `reachable` cells are to be seen.
    """

    def __init__(
        self,
        world: World,
        truth: Grid,
        kinds: Mapping[str, RobotType],
        assignment: Assignment,
        observer: Observer,
    ) -> None:
        self._world, self._kinds = world, kinds
        self._assignment, self._observer = assignment, observer
        self._homes = homes_of(world.robots(), kinds)
        self._surveyor = Surveyor(Territory(truth.solid(), tuple(kinds.values())), self._homes, assignment.goal)
        self._executor = Executor(world, self._surveyor.route, observer)
        self._reachable = np.zeros_like(truth.cells) if assignment.reachable is None else assignment.reachable
        self._left = int(np.count_nonzero(self._reachable))
        self._revision = 0
        self._exploration_ms: int | None = None
        self._points: dict[str, MapMeeting] = {}

    def run(
        self,
        plan: Plan,
        poses: Poses,
        targets: tuple[MapTarget, ...],
        meetings: tuple[MapMeeting, ...],
        cancelled: Callable[[], bool] | None = None,
    ) -> MissionEnded:
        """Carry `plan` out, then what else the mission wants; `poses` says where its places are."""
        self._points = {point.name: point for point in meetings}
        self._take_in(self._world.advance(0))
        self._adopt("start", plan, poses, targets, meetings)
        while True:
            ended = self._next_phase()
            if ended is not None:
                return self._end(*ended)
            self._executor.start_due()
            if self._world.now_ms >= self._assignment.limits.time_ms:
                return self._end(Status.TIME_LIMIT, f"time limit of {self._world.now_ms / 1000:g} s reached")
            if cancelled is not None and cancelled():
                return self._end(Status.CANCELLED, "cancelled")
            self._take_in(self._world.advance(self._assignment.limits.time_ms))

    def _take_in(self, news: News) -> None:
        for name, indices in news.revealed:
            runs = runs_of(indices, self._world.grid.cells.ravel())
            self._observer.event(Revealed(t_ms=news.t_ms, robot=name, runs=runs))
            self._left -= int(np.count_nonzero(self._reachable.ravel()[indices]))
        self._executor.finished(news.finished)

    def _next_phase(self) -> tuple[Status, str] | None:
        """Turn to what comes after exploring, once that is done; return how the mission ends if it does."""
        if self._exploration_ms is None and not self._left:
            self._exploration_ms = self._world.now_ms
            self._bring_back()
        elif self._executor.idle:
            if self._exploration_ms is None:
                return Status.STALLED, "the plan leaves a part of the reachable area unexplored"
            if not self._satisfied() and not self._bring_back():
                return Status.STALLED, "not every rover can be brought back"
        if self._exploration_ms is not None and self._executor.idle and self._satisfied():
            return Status.COMPLETE, "all of the reachable area is known" + wishes(self._assignment.goal)
        return None

    def _bring_back(self) -> bool:
        """Follow a plan for what the mission asks for besides exploring; return whether there is something to do.

        Rovers can always be picked up where they were set down: those meeting points are kept.
        """
        keep = [self._points[name] for name in sorted(self._points.keys() & self._executor.deployed_at.values())]
        survey = self._surveyor.survey(self._world.robots(), self._world.now_ms, keep)
        plan, _ = serve(survey.situation)
        self._adopt("explored", plan, survey.poses, (), survey.meetings)
        return bool(plan.actions)

    def _adopt(
        self,
        trigger: str,
        plan: Plan,
        poses: Poses,
        targets: tuple[MapTarget, ...],
        meetings: tuple[MapMeeting, ...],
    ) -> None:
        self._revision += 1
        plan = shifted(plan, self._world.now_ms)
        self._observer.event(
            Planned(
                t_ms=self._world.now_ms,
                revision=self._revision,
                trigger=trigger,
                targets=targets,
                meetings=meetings,
                actions=plan.actions,
            )
        )
        self._executor.adopt(plan, poses, self._revision)

    def _satisfied(self) -> bool:
        """Say whether the mission's wishes beyond exploring are met."""
        goal, robots = self._assignment.goal, self._world.robots()
        aboard = all(r.carrier is not None for r in robots if self._kinds[r.type].role is Role.ROVER)
        home = all(r.cell == self._homes[r.name] for r in robots if r.name in self._homes)
        return (aboard or not (goal.recover_rovers or goal.return_home)) and (home or not goal.return_home)

    def _end(self, status: Status, reason: str) -> MissionEnded:
        world, area = self._world, self._world.grid.cell_area_m2
        robots, reachable = world.robots(), int(np.count_nonzero(self._reachable))
        known = Surveyor(Territory(world.grid, tuple(self._kinds.values())), {}, self._assignment.goal)
        targets = known.targets(robots)
        left = f"still open when the mission ended: {reason}" if self._left else "nothing reachable is behind it"
        ended = MissionEnded(
            t_ms=world.now_ms,
            status=status,
            reason=reason,
            exploration_ms=self._exploration_ms,
            explored_area_m2=round((reachable - self._left) * area, 6),
            reachable_area_m2=round(reachable * area, 6),
            distance_m=tuple((r.name, round(world.distance_m(r.name), 3)) for r in robots),
            energy_j=energy_j(self._world, self._kinds),
            deployments=self._executor.deployments,
            retrievals=self._executor.retrievals,
            replans=self._revision,
            plans_valid=self._revision,
            plans_invalid=0,
            aboard=tuple(r.name for r in robots if r.carrier is not None),
            remaining=known.remaining(targets, left),
        )
        self._observer.event(ended)
        return ended
