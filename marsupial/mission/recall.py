"""Calls a team back, in time for the time limit, so that rovers are aboard (or the team is home) when the mission ends.

`Recall` estimates how long the way back takes by list scheduling a survey without targets, and compares that with the
time left.

Estimates are rare, since two bounds show when none is needed. The way back takes as long as the way out, so the first
half of the mission needs no estimate, unless robots slow down or known ground changes. And driving for another 1 s uses
up at most 2 s of slack (1 s has passed, the way back is 1 s longer) plus a share for the reserve, so the next estimate
waits for a third of the slack.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory
from marsupial.model import SQRT2, ActionName, Cell, Goal, News, PlanProgress, RobotType, Role, World
from marsupial.model.mission import MapMeeting
from marsupial.planning.greedy import serve

# Reserve when the team is back: robots sometimes drive slower than planned, and stop at a cell before they turn.
SPARE_SHARE = 0.1  # of the time for the way back
SPARE_MS = 3000  # in addition

STEP_MS = 1000  # least time between two estimates of the way back
CHANGE_MS = 30_000  # the same for estimates because known ground changed: a map built by SLAM changes all the time


class Recall:
    """Decides when a team has to turn back to reach `goal` (rovers aboard, or all at home) by the time limit."""

    def __init__(self, world: World, kinds: Mapping[str, RobotType], goal: Goal, limit_ms: int) -> None:
        self._world, self._kinds, self._goal, self._limit_ms = world, kinds, goal, limit_ms
        team = world.robots()
        rovers = [robot for robot in team if kinds[robot.type].role is Role.ROVER]
        self._needed = goal.return_home or (goal.recover_rovers and bool(rovers))
        together = all(rover.carrier is not None for rover in rovers)
        handling_ms = sum(kinds[rover.type].dock_ms + kinds[rover.type].undock_ms for rover in rovers)
        way_ms = max(0, limit_ms - handling_ms - self._spare_ms - STEP_MS)  # way out and back
        self._first_ms = round(way_ms / (2 + SPARE_SHARE)) if together else 0
        self._next_ms = self._first_ms if self._needed else limit_ms
        self._known_out: frozenset[str] = frozenset()
        self._estimated_ms = -CHANGE_MS

    @property
    def _spare_ms(self) -> int:
        # a robot can't turn back between two cells: it drives to the next one, and back from there
        cell_m = SQRT2 * self._world.grid.resolution_m
        cell_s = max(cell_m / (self._kinds[robot.type].speed_mps * robot.speed) for robot in self._world.robots())
        return max(SPARE_MS, round(2000 * cell_s))

    def update(self, news: News) -> None:
        """Note news that may make the way back longer than the way out was, or than it was estimated."""
        if not self._needed:
            return
        if news.slowed or news.lost or news.returned or news.zones or news.out_of_contact:
            self._first_ms, self._next_ms = 0, min(self._next_ms, news.t_ms)
        elif self._closes_ways(news):
            again_ms = max(news.t_ms, self._estimated_ms + CHANGE_MS)
            self._first_ms, self._next_ms = min(self._first_ms, again_ms), min(self._next_ms, again_ms)

    def _closes_ways(self, news: News) -> bool:
        """Return whether some robot can't drive on a cell whose known terrain changed."""
        if not news.changed:
            return False
        cells = self._world.grid.cells.ravel()
        codes = {int(code) for _, indices in news.changed for code in np.unique(cells[indices])}
        return any(not codes <= kind.terrains for kind in self._kinds.values())

    def wake_ms(self, busy_ms: int) -> int:
        """Return when to call `due` next at the latest, if the team's plan keeps it busy until `busy_ms`."""
        quiet = self._world.now_ms < self._first_ms and busy_ms <= self._next_ms
        return self._limit_ms if quiet else self._next_ms

    def due(self, homes: Mapping[str, Cell], work: PlanProgress, planning_ms: int) -> bool:
        """Return whether the team has to turn back now, if planning takes `planning_ms`."""
        now_ms = self._world.now_ms
        if not self._needed or now_ms < self._first_ms:
            return False
        out = self._out(work)
        # between estimates, only another rover on the ground makes the way back longer than estimated
        if now_ms < self._next_ms and out <= self._known_out:
            return False
        self._known_out, self._next_ms, self._estimated_ms = out, self._limit_ms, now_ms
        if not out and not self._goal.return_home:
            return False
        # robots that can't get back don't count
        territory = Territory(self._world.grid, tuple(self._kinds.values()))
        survey = returning(Surveyor(territory, homes, self._goal), self._world)
        needed_ms = serve(survey.situation)[0].makespan_ms
        # the longest time to set down one of these rovers that is still aboard, and to pick it up again
        aboard = [self._kinds[r.type] for r in self._world.robots() if r.name in out and r.carrier is not None]
        sortie_ms = max((kind.undock_ms + kind.dock_ms for kind in aboard), default=0)
        reserve_ms = round(SPARE_SHARE * needed_ms) + self._spare_ms + planning_ms + sortie_ms
        spare_ms = self._limit_ms - now_ms - needed_ms - reserve_ms
        self._next_ms = now_ms + max(STEP_MS, spare_ms // 3)
        return spare_ms <= 0

    def _out(self, work: PlanProgress) -> frozenset[str]:
        """Return the rovers on the ground, and those that the plan is about to set down."""
        soon_ms = self._world.now_ms + STEP_MS
        undocks = (action for action in work.remainder() if action.name is ActionName.UNDOCK)
        planned = {action.robot for action in undocks if action.start_ms <= soon_ms}
        rovers = (r for r in self._world.robots() if self._kinds[r.type].role is Role.ROVER and not r.lost)
        return frozenset(rover.name for rover in rovers if rover.carrier is None or rover.name in planned)


def returning(surveyor: Surveyor, world: World, keep: Sequence[MapMeeting] = ()) -> Survey:
    """Return the current survey for a team that only returns: no targets."""
    return surveyor.survey(world.robots(), world.now_ms, keep, targets=(), returning=True)
