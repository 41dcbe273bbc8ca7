"""The options of each robot for each target, when each would explore the target, and their best assignment.

A robot can drive to a target itself. A carrier can set down a rover that is aboard, at the meeting from which the rover
arrives first; or it can first pick up a rover on the ground, at the meeting with the earliest arrival overall (a full
carrier sets another rover down there). All times are exact: they include running actions, waiting for each other,
docking and undocking.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.model import Plan, Role, Situation
from marsupial.model.grid import Mask
from marsupial.model.plan import first_targets
from marsupial.planning.matching import least_assignment
from marsupial.planning.schedule.costs import NEVER, Costs, Detours
from marsupial.planning.schedule.insertions import Insertions
from marsupial.planning.schedule.timeline import Timeline, transport

KEEP_MS = 2000  # bonus for a robot's previous target, so that robots do not change targets without a gain

_IMPOSSIBLE = 1e15  # ms; more than any sum of possible times


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One way for a robot to contribute to exploring each target; arrays are int64 (targets,)."""

    robot: str  # the explorer, or the carrier that brings it
    explorer: str  # the robot that explores
    retrieved: bool  # whether the explorer is picked up from the ground first
    meeting: Ints | None  # index of the best meeting to set the explorer down; None if it drives itself
    end_ms: Ints  # when the target would be explored; `NEVER` or later if that is impossible

    def only(self, targets: Mask) -> Option:
        """Return the option restricted to these targets, a mask (targets,)."""
        return replace(self, end_ms=np.where(targets, self.end_ms, NEVER))


class Outlook:
    """The actions chosen so far, and the options for the next ones; `previous` is the rest of the current plan."""

    def __init__(self, situation: Situation, previous: Plan | None = None) -> None:
        self._detours = Detours(situation)
        self.situation = self._detours.situation  # with complete travel tables: detours stand for missing direct paths
        self._costs = Costs(self.situation)
        self.targets = [target.name for target in self.situation.targets]
        self._before = first_targets(() if previous is None else previous.actions)
        self._begin()

    def emptied(self) -> Outlook:
        """Return a copy without any action."""
        other = copy(self)
        other._begin()
        return other

    def _begin(self) -> None:
        self.timeline = Timeline.of(self.situation)
        self._insertions = Insertions(self.timeline, self._costs, np.ones(len(self.targets), dtype=np.bool_))

    @property
    def plan(self) -> Plan:
        """The actions so far, as a plan for the original situation."""
        return self._detours.expanded(self.timeline.plan)

    def alone_ms(self, robot: str) -> Ints:
        """Return when `robot` would explore each target if it drives there itself."""
        return self._insertions.alone_ms[self._insertions.arrivals.row[robot]]

    def options(self, robot: str, *, retrievable: Set[str] = frozenset()) -> list[Option]:
        """Return the options of a robot on the ground; a carrier may retrieve the rovers `retrievable`."""
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
                # row 0: a rover that is aboard; row 1 + n: one that carrier n picks up first
                landed = self._insertions.landed_ms[1 + number if retrieved else 0, k]
                via = landed[:, None] + self._costs.sortie[known.kinds[v]]
                best = via.argmin(axis=0)
                end_ms = via.min(axis=0)
                found.append(Option(robot=robot, explorer=rover, retrieved=retrieved, meeting=best, end_ms=end_ms))
        return found

    def assign(self, options: Sequence[Sequence[Option]]) -> list[tuple[Option, int]]:
        """Return the Hungarian assignment of robots to targets, with the least sum of times; earliest first."""
        if not options or not self.targets:
            return []
        choices = [[self._cost(option) for option in mine] for mine in options]
        best = [np.argmin(mine, axis=0) for mine in choices]
        costs = np.array([np.min(mine, axis=0) for mine in choices])
        rows, columns = least_assignment(costs)
        # an impossible pair costs more than all possible ones, so their number is minimal; they are dropped
        pairs = sorted(zip(costs[rows, columns].tolist(), rows.tolist(), columns.tolist(), strict=True))
        return [(options[i][best[i][target]], target) for cost, i, target in pairs if cost < _IMPOSSIBLE / 2]

    def take(self, option: Option, target: int) -> None:
        """Add the actions of a possible option."""
        if option.robot != option.explorer:
            transport(self.timeline, option.explorer, self._insertions.journey(option.explorer, option.robot, target))
        self.explore(option.explorer, target)

    def explore(self, robot: str, target: int) -> None:
        """Send `robot` to explore a target that it can reach."""
        self.timeline.explore(robot, self.targets[target])
        self._insertions.advance()

    def approach(self, option: Option, target: int) -> None:
        """Send the robot of an option to the target, or to the meeting where it would set a rover down."""
        if option.meeting is None:
            self.explore(option.robot, target)
        else:
            self.go(option.robot, self.situation.meetings[int(option.meeting[target])])

    def go(self, robot: str, meeting: str) -> None:
        """Send `robot` to a meeting that it can reach, unless it is already there."""
        at = self.timeline.at[robot]
        kind = self.situation.robot_by_name[robot].type
        if at is not None and self.situation.travel(kind, at, meeting):
            self.timeline.move(robot, meeting)
            self._insertions.advance()

    def wait_at_meeting(self, rover: str) -> None:
        """Send a rover to the nearest meeting, where it can be picked up."""
        arrive = self._insertions.arrivals.arrive_ms[self._insertions.arrivals.row[rover]]
        if arrive.min(initial=NEVER) < NEVER:
            self.go(rover, self.situation.meetings[int(arrive.argmin())])

    def stand_by(self, robots: Iterable[str]) -> None:
        """Send robots without a target near other robots' targets, so that they are close to new targets there.

        A carrier waits where it would set a rover down, a rover that can reach no target at the nearest meeting.
        """
        waiting = list(robots)
        while sent := self.assign([self.options(robot) for robot in waiting]):
            for option, target in sent:
                self.approach(option, target)
                waiting.remove(option.robot)
        for robot in waiting:
            if self.situation.type_of(robot).role is Role.ROVER:
                self.wait_at_meeting(robot)

    def _cost(self, option: Option) -> Floats:
        """Return the cost of each target as (targets,): when it would be explored, in ms, less the bonus."""
        cost = np.where(option.end_ms < NEVER, option.end_ms.astype(np.float64), _IMPOSSIBLE)
        before = self._before.get(option.explorer)
        if before in self.targets:
            cost[self.targets.index(before)] -= KEEP_MS  # an impossible target still costs far more than all others
        return cost
