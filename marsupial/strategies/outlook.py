"""What each robot could do next for each target, when that would be done, and who had best do what.

A robot on the ground drives to a target itself; a carrier sets down a rover that is aboard at the meeting from which
it gets there soonest; or it first picks up a rover on the ground, at the meeting that makes the whole soonest (a full
carrier sets another down there). All times are arrivals that the checker would confirm: running actions, waiting for
each other, docking and undocking included.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Floats
from marsupial.model.plan import ActionName, Plan
from marsupial.model.situation import Situation
from marsupial.planning.list_scheduling.costs import NEVER, Costs, Indices, Mask, Times
from marsupial.planning.list_scheduling.detours import Detours
from marsupial.planning.list_scheduling.insertions import Insertions
from marsupial.planning.list_scheduling.timeline import Timeline
from marsupial.planning.list_scheduling.transports import transport
from marsupial.planning.matching import least_assignment

LOYALTY_MS = 2000
"""How much sooner the target that a robot was to explore so far counts as, so that plans do not flap."""

_IMPOSSIBLE = 1e15  # ms; more than all that is possible together


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One way for a robot to take part in the exploring of targets; arrays are int64 (targets,).

    Parameters
    ----------
    robot
        Whose option it is: the explorer, or the carrier that brings it.
    explorer
        Who explores.
    retrieved
        Whether the explorer is picked up from the ground first.
    meeting
        Index of the meeting at which the explorer is best set down; None where it drives itself.
    end_ms
        When the target would be explored; `NEVER` or later where that is not possible.
    """

    robot: str
    explorer: str
    retrieved: bool
    meeting: Indices | None
    end_ms: Times

    def only(self, targets: Mask) -> Option:
        """Return the option for no others than these targets, a mask (targets,)."""
        return replace(self, end_ms=np.where(targets, self.end_ms, NEVER))


class Outlook:
    """The actions chosen so far, and what could come next.

    Parameters
    ----------
    previous
        What is left of the plan so far.

    Attributes
    ----------
    situation
        With every hole in its travel tables filled.
    targets
        Names of the targets, in the order of all arrays.
    """

    def __init__(self, situation: Situation, previous: Plan | None = None) -> None:
        self._detours = Detours(situation)
        self.situation = self._detours.situation
        self._costs = Costs(self.situation)
        self.targets = [target.name for target in self.situation.targets]
        self._before = _first_targets(previous)
        self._begin()

    def afresh(self) -> Outlook:
        """Return the outlook with no action chosen."""
        other = copy(self)
        other._begin()
        return other

    def _begin(self) -> None:
        self.timeline = Timeline.of(self.situation)
        self._insertions = Insertions(self.timeline, self._costs, np.ones(len(self.targets), dtype=np.bool_))

    @property
    def plan(self) -> Plan:
        """The actions so far, as a plan for the situation as it was given."""
        return self._detours.told(self.timeline.plan)

    def alone_ms(self, robot: str) -> Times:
        """Return when `robot` would have explored each target, driving there itself."""
        return self._insertions.alone_ms[self._insertions.arrivals.row[robot]]

    def options(self, robot: str, *, retrievable: Set[str] = frozenset()) -> list[Option]:
        """Return what a robot on the ground could do; of the rovers there it may retrieve those `retrievable`."""
        alone = self.alone_ms(robot)
        found = [Option(robot=robot, explorer=robot, retrieved=False, meeting=None, end_ms=alone)]
        known = self._insertions.arrivals
        row = known.row[robot]
        if row not in known.carriers or not self.situation.meetings or not self.targets:
            return found
        number = known.carriers.index(row)
        for k, v in enumerate(known.rovers):
            rover = known.robots[v]
            if known.aboard[k] == number or rover in retrievable:
                retrieved = known.aboard[k] < 0
                landed = self._insertions.landed_ms[1 + number if retrieved else 0, k]
                via = landed[:, None] + self._costs.sortie[known.kinds[v]]
                best = via.argmin(axis=0)
                end_ms = via.min(axis=0)
                found.append(Option(robot=robot, explorer=rover, retrieved=retrieved, meeting=best, end_ms=end_ms))
        return found

    def assign(self, options: Sequence[Sequence[Option]]) -> list[tuple[Option, int]]:
        """Return who does what so that most robots have a target and the sum of the times is least; soonest first.

        Parameters
        ----------
        options
            Per robot what it could do; each gets at most one target, each target at most one robot (Hungarian method).
        """
        if not options or not self.targets:
            return []
        choices = [[self._cost(option) for option in mine] for mine in options]
        best = [np.argmin(mine, axis=0) for mine in choices]
        costs = np.array([np.min(mine, axis=0) for mine in choices])
        rows, columns = least_assignment(costs)
        pairs = sorted(zip(costs[rows, columns].tolist(), rows.tolist(), columns.tolist(), strict=True))
        return [(options[i][best[i][target]], target) for cost, i, target in pairs if cost < _IMPOSSIBLE / 2]

    def take(self, option: Option, target: int) -> None:
        """Add the actions of an option that is possible."""
        if option.robot != option.explorer:
            transport(self.timeline, option.explorer, self._insertions.journey(option.explorer, option.robot, target))
        self.explore(option.explorer, target)

    def explore(self, robot: str, target: int) -> None:
        """Let `robot` drive to a target that it can get to, and explore it."""
        self.timeline.explore(robot, self.targets[target])
        self._insertions.advance()

    def has_work(self, robot: str) -> bool:
        """Say whether `robot` takes part in an action."""
        return any(robot in action.robots for action in self.timeline.actions)

    def approach(self, option: Option, target: int) -> None:
        """Let the robot of an option go as far as it goes itself: to the target, or to where it would set down."""
        if option.meeting is None:
            self.explore(option.robot, target)
        else:
            self.go(option.robot, self.situation.meetings[int(option.meeting[target])])

    def go(self, robot: str, meeting: str) -> None:
        """Let `robot` drive to a meeting that it can get to, unless it is there."""
        at = self.timeline.at[robot]
        kind = self.situation.robot_by_name[robot].type
        if at is not None and self.situation.travel(kind, at, meeting):
            self.timeline.move(robot, meeting)
            self._insertions.advance()

    def wait_at_meeting(self, rover: str) -> None:
        """Let a rover drive to the nearest meeting, where it can be picked up."""
        arrive = self._insertions.arrivals.arrive_ms[self._insertions.arrivals.row[rover]]
        if arrive.min(initial=NEVER) < NEVER:
            self.go(rover, self.situation.meetings[int(arrive.argmin())])

    def _cost(self, option: Option) -> Floats:
        """Return float64 (targets,): when each target would be explored, in ms, less what loyalty counts for."""
        cost = np.where(option.end_ms < NEVER, option.end_ms.astype(np.float64), _IMPOSSIBLE)
        before = self._before.get(option.explorer)
        if before in self.targets:
            cost[self.targets.index(before)] -= LOYALTY_MS  # an impossible one stays far beyond all others
        return cost


def _first_targets(previous: Plan | None) -> Mapping[str, str]:
    first: dict[str, str] = {}
    for action in () if previous is None else previous.actions:
        if action.name is ActionName.EXPLORE:
            first.setdefault(action.robot, action.place)
    return first
