"""Calls a team back in time: as long as a mission has a time limit, rovers are not to be out when it is over.

How long it takes to get back is found as anything else is planned: by list scheduling, for the moment's survey with
nothing left to explore. That is done seldom. A team gets back the way it came in the time that it took, so nothing
need be found out before about half of the time is over; and who drives on for a second is at most two seconds further
from being back, so after an answer the next one can wait for a third of what is left to spare.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from marsupial.maps.lookout import Lookout, setbacks_in
from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.targets import Target
from marsupial.maps.territory import Territory
from marsupial.mission.replanning import OnNews
from marsupial.model.grid import Cell
from marsupial.model.mission import Cause, MapMeeting, Trigger, Triggers
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import SQRT2, RobotType, Role
from marsupial.model.scenario import Goal
from marsupial.model.strategy import PlanProgress
from marsupial.model.world import News, World
from marsupial.planning.list_scheduling.greedy import serve

SPARE_SHARE, SPARE_MS = 0.1, 3000
"""What is to be left when the team is back: this share of the time that getting back takes, and so many ms. Robots
are slower than planned for at times, and stop at a cell before they turn."""

STEP_MS = 1000
"""Least time between two looks at how long it takes to get back."""


class Recall:
    """Says when the time left is only just enough for a team to get back.

    Parameters
    ----------
    goal
        What being back means.
    limit_ms
        When the mission is over.
    """

    def __init__(self, world: World, kinds: Mapping[str, RobotType], goal: Goal, limit_ms: int) -> None:
        self._world, self._kinds, self._goal, self._limit_ms = world, kinds, goal, limit_ms
        team = world.robots()
        rovers = [robot for robot in team if kinds[robot.type].role is Role.ROVER]
        self._asked = goal.return_home or (goal.recover_rovers and bool(rovers))
        together = all(rover.carrier is not None for rover in rovers)
        handling_ms = sum(kinds[rover.type].dock_ms + kinds[rover.type].undock_ms for rover in rovers)
        # a robot can't turn back between two cells: it may get on by one, and has to come back from there
        cell_s = max(SQRT2 * world.grid.resolution_m / kinds[robot.type].speed_mps for robot in team)
        self._spare_ms = max(SPARE_MS, round(2000 * cell_s))
        way_ms = max(0, limit_ms - handling_ms - self._spare_ms - STEP_MS)  # there and back
        self._first_ms = round(way_ms / (2 + SPARE_SHARE)) if together else 0
        self._next_ms = self._first_ms if self._asked else limit_ms
        self._known_out: frozenset[str] = frozenset()

    def wake_ms(self, busy_ms: int) -> int:
        """Return when to ask next, at the latest, if the team is busy with what it does until `busy_ms`."""
        quiet = self._world.now_ms < self._first_ms and busy_ms <= self._next_ms
        return self._limit_ms if quiet else self._next_ms

    def due(self, homes: Mapping[str, Cell], work: PlanProgress, planning_ms: int) -> bool:
        """Say whether the team has to turn back now, if making a plan takes so long."""
        now_ms = self._world.now_ms
        if not self._asked or now_ms < self._first_ms:
            return False
        out = self._out(work)
        if now_ms < self._next_ms and out <= self._known_out:
            return False
        self._known_out, self._next_ms = out, self._limit_ms
        if not out and not self._goal.return_home:
            return False
        needed_ms = self._back_ms(homes)
        reserve_ms = round(SPARE_SHARE * needed_ms) + self._spare_ms + planning_ms + self._sortie_ms(out)
        spare_ms = self._limit_ms - now_ms - needed_ms - reserve_ms
        self._next_ms = now_ms + max(STEP_MS, spare_ms // 3)
        return spare_ms <= 0

    def _out(self, work: PlanProgress) -> frozenset[str]:
        """Return the rovers that are out, or are to be set down now by the plan that is followed."""
        soon_ms = self._world.now_ms + STEP_MS
        undocks = (action for action in work.remainder() if action.name is ActionName.UNDOCK)
        planned = {action.robot for action in undocks if action.start_ms <= soon_ms}
        rovers = (r for r in self._world.robots() if self._kinds[r.type].role is Role.ROVER and not r.lost)
        return frozenset(rover.name for rover in rovers if rover.carrier is None or rover.name in planned)

    def _back_ms(self, homes: Mapping[str, Cell]) -> int:
        """Return how long it takes from now on to get back, as far as that is possible."""
        territory = Territory(self._world.grid, tuple(self._kinds.values()))
        survey = returning(Surveyor(territory, homes, self._goal), self._world)
        return serve(survey.situation)[0].makespan_ms

    def _sortie_ms(self, out: Set[str]) -> int:
        """Return how long it takes to set down one of these that is still aboard, and to pick it up again."""
        aboard = [self._kinds[r.type] for r in self._world.robots() if r.name in out and r.carrier is not None]
        return max((kind.undock_ms + kind.dock_ms for kind in aboard), default=0)


def returning(surveyor: Surveyor, world: World, keep: Sequence[MapMeeting] = ()) -> Survey:
    """Return the moment's survey for a team that explores no more."""
    return surveyor.survey(world.robots(), world.now_ms, keep, targets=(), returning=True)


class WayBack(Lookout):
    """Replans when something went wrong, or a plan is carried out; what is there to explore is of no account."""

    @property
    def wake_ms(self) -> int | None:
        """Return None: what is seen is no news."""
        return None

    def look(self, news: News, done: Sequence[Action], work: PlanProgress) -> Triggers:
        """Return the setbacks, or that the plan is carried out."""
        return setbacks_in(news) or ((Trigger(Cause.CARRIED_OUT),) if work.idle else ())

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        """Return what the map known so far means for a team that explores no more."""
        return returning(self._surveyor, self._world, keep)

    def follow(self, survey: Survey, since: Survey | None = None) -> None:
        """Leave it at that: what is seen is no news."""


class CarriersAlone(OnNews):
    """Uses the time that is left once the rovers are aboard: carriers explore on, and set nobody down any more."""

    def survey(self, work: PlanProgress, keep: Sequence[MapMeeting], *, late: bool = False) -> Survey:
        """Return what the map known so far means for the carriers."""
        return self._surveyor.survey(self._world.robots(), self._world.now_ms, targets=self._targets(), docking=False)

    def _targets(self) -> tuple[Target, ...]:
        carriers = {name for name, kind in self._kinds.items() if kind.role is Role.CARRIER}
        return tuple(target for target in super()._targets() if not carriers.isdisjoint(target.viewpoints))

    def _note_explored(self, *, left: bool) -> None:
        """Leave it at that: what only rovers can explore is left."""
