"""The paper's baseline: carriers assigned by travel cost alone, rovers deployed by rule.

Carriers are assigned to targets at the least total travel cost, whether they can explore them or not. A carrier that
can't explore its target goes to the nearest meeting point that connects to it and sets a rover down there; a carrier
without a rover has to retrieve one first. A rover on the ground explores the targets that its meeting point gives
access to and returns to that point.

What the text leaves open, and how it is filled:

- how costs become an assignment: Hungarian method. The cheapest pair is decided on and the others are assigned again,
  since a rover that is set down takes care of more than one target. Costs lead over all ground that any type can
  drive on (`Briefing.direct_ms`); until its running action ends a carrier is that much farther away;
- targets that a rover on the ground, or about to be set down, will explore are not assigned to a carrier;
- "nearest" meeting point: to the carrier; if none connects to the target's area, any from which a rover gets there;
- targets "reachable from the meeting point": those only rovers can explore; in the order nearest first;
- which rover is retrieved and where: one without targets left if there is one, then the one that can be met soonest.
  A full carrier does not exchange rovers;
- a carrier without a target waits; one that can't serve its target is assigned another;
- once no target is left rovers are recovered by list scheduling (`marsupial.strategies.rules`).

References
----------
Wurm et al. 2010, section IV-B, which refers to Stachniss, Robotic Mapping and Exploration, 2009, for the assignment.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field

import numpy as np

from marsupial.arrays import Floats
from marsupial.model.plan import ActionName, Plan
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, RobotState
from marsupial.model.strategy import Briefing, Decision
from marsupial.planning.list_scheduling.timeline import Timeline
from marsupial.planning.matching import least_assignment
from marsupial.strategies.rules import decide_by

_FAR = 1e12


class Heuristic:
    """The deployment heuristic of the paper's evaluation."""

    name = "heuristic"

    def decide(self, briefing: Briefing) -> Decision:
        """Return the assignment's plan; one target per carrier, all its area's targets per rover."""
        return decide_by(self.name, _explore, briefing)


def _explore(briefing: Briefing) -> tuple[Plan, frozenset[str]]:
    draft = _Assignments(Timeline.of(briefing.situation))
    ground = [r for r in briefing.situation.of_role(Role.ROVER) if r.place is not None]
    areas = {r.name: _area(briefing, r, briefing.deployed_at.get(r.name)) for r in ground}
    _rovers_explore(draft, [r.name for r in ground], areas)
    for rover in ground:
        _return(draft, rover, briefing.deployed_at.get(rover.name))
    stuck = _send_carriers(briefing, draft, {r.name for r in ground})
    return draft.timeline.plan, frozenset(stuck)


@dataclass(slots=True)
class _Assignments:
    """The actions chosen so far and the targets that they take care of."""

    timeline: Timeline
    taken: set[str] = field(default_factory=set)

    def explore(self, robot: str, target: str) -> None:
        self.timeline.explore(robot, target)
        self.taken.add(target)

    def travel(self, robot: str, place: str) -> int | None:
        situation = self.timeline.situation
        return situation.travel(situation.robot_by_name[robot].type, self.timeline.at[robot] or "", place)

    def arrivals_ms(self, robot: str, places: Sequence[str]) -> Floats:
        """Return how soon the robot can be at n places (n,), inf where it can't."""
        index = self.timeline.situation.place_index
        table = self.timeline.situation.travel_ms[self.timeline.situation.robot_by_name[robot].type]
        times = table[index[self.timeline.at[robot] or ""], [index[place] for place in places]]
        return np.where(times == UNREACHABLE, np.inf, self.timeline.ready_ms[robot] + times)


def _area(briefing: Briefing, rover: RobotState, meeting: str | None) -> frozenset[str]:
    """Return the targets a rover takes care of from `meeting`: those of the rover-only areas it connects to.

    Where it connects to none, all those that only rovers can explore.
    """
    situation = briefing.situation
    carriers = {kind.name for kind in situation.types if kind.role is Role.CARRIER}
    mine = {t.name for t in situation.targets if rover.type in t.explorers and not t.explorers & carriers}
    connected = frozenset() if meeting is None else briefing.connects.get(meeting, frozenset())
    return frozenset(mine & connected or mine)


def _rovers_explore(draft: _Assignments, rovers: Iterable[str], areas: Mapping[str, Set[str]]) -> None:
    """Let rovers explore the targets of their areas; again and again the one that is soonest at a target takes it."""
    order = sorted(rovers)
    targets = sorted(frozenset[str]().union(*(areas[rover] for rover in order)) - draft.taken)
    if not targets:
        return
    mine = np.array([[target in areas[rover] for target in targets] for rover in order])
    there_ms = np.stack([draft.arrivals_ms(rover, targets) for rover in order])
    while True:
        left_ms = np.where(mine, there_ms, np.inf)
        first, target = np.unravel_index(left_ms.argmin(), left_ms.shape)
        if np.isinf(left_ms[first, target]):
            return
        draft.explore(order[first], targets[target])
        mine[:, target] = False
        there_ms[first] = draft.arrivals_ms(order[first], targets)


def _return(draft: _Assignments, rover: RobotState, meeting: str | None) -> None:
    if meeting is not None and draft.travel(rover.name, meeting):
        draft.timeline.move(rover.name, meeting)


def _send_carriers(briefing: Briefing, draft: _Assignments, waiting: set[str]) -> set[str]:
    """Assign carriers to targets until one of both runs out; return the targets no robot could be sent to."""
    situation = briefing.situation
    direct = briefing.direct_ms()
    free = [robot.name for robot in situation.of_role(Role.CARRIER) if robot.name in direct]
    hopeless: set[tuple[str, str]] = set()
    while free:
        open_targets = [t.name for t in situation.targets if t.name not in draft.taken]
        pair = _cheapest_pair(free, open_targets, direct, draft, hopeless)
        if pair is None:
            break
        carrier, target = pair
        if _serve(briefing, draft, carrier, target, waiting):
            free.remove(carrier)
        else:
            hopeless.add(pair)
    return {target for _, target in hopeless} - draft.taken


def _cheapest_pair(
    carriers: Sequence[str],
    targets: Sequence[str],
    direct: Mapping[str, Mapping[str, int]],
    draft: _Assignments,
    hopeless: Set[tuple[str, str]],
) -> tuple[str, str] | None:
    """Return the cheapest pair of the optimal assignment of carriers to targets, hopeless pairs left out."""
    if not targets:
        return None
    cost = np.full((len(carriers), len(targets)), _FAR)
    for i, carrier in enumerate(carriers):
        for j, target in enumerate(targets):
            if target in direct[carrier] and (carrier, target) not in hopeless:
                cost[i, j] = draft.timeline.ready_ms[carrier] + direct[carrier][target]
    rows, columns = least_assignment(cost)
    best = min(zip(cost[rows, columns].tolist(), rows.tolist(), columns.tolist(), strict=True))
    return (carriers[best[1]], targets[best[2]]) if best[0] < _FAR else None


def _serve(briefing: Briefing, draft: _Assignments, carrier: str, target: str, waiting: set[str]) -> bool:
    """Let `carrier` explore `target` or bring a rover that does; return False if it can't."""
    situation = briefing.situation
    explorers = situation.target_by_name[target].explorers
    if situation.robot_by_name[carrier].type in explorers and draft.travel(carrier, target) is not None:
        draft.explore(carrier, target)
        return True
    fitting = {kind for kind in explorers if _nearest_meeting(briefing, draft, carrier, target, kind) is not None}
    aboard = [r.name for r in situation.robots if r.carrier == carrier and r.type in fitting]
    rover = aboard[0] if aboard else _retrieve(briefing, draft, carrier, fitting, waiting)
    if rover is None:
        return False
    state = situation.robot_by_name[rover]
    meeting = _nearest_meeting(briefing, draft, carrier, target, state.type)
    assert meeting is not None, "a carrier that gets to one meeting point gets to it from the next"
    draft.timeline.undock(rover, meeting)
    _rovers_explore(draft, [rover], {rover: _area(briefing, state, meeting) | {target}})
    _return(draft, state, meeting)
    return True


def _nearest_meeting(briefing: Briefing, draft: _Assignments, carrier: str, target: str, kind: str) -> str | None:
    """Return the meeting point nearest to the carrier from which a rover of type `kind` gets to the target."""
    situation = briefing.situation
    options = [
        (target not in briefing.connects.get(meeting, frozenset()), travel, meeting)
        for meeting in situation.meetings
        if (travel := draft.travel(carrier, meeting)) is not None
        and situation.travel(kind, meeting, target) is not None
    ]
    return min(options)[2] if options else None


def _retrieve(
    briefing: Briefing, draft: _Assignments, carrier: str, explorers: Iterable[str], waiting: set[str]
) -> str | None:
    """Let `carrier` pick a rover up first; return which, or None if there is none to be had."""
    situation, ready_ms = briefing.situation, draft.timeline.ready_ms
    options = []
    for rover in sorted(waiting):
        if situation.robot_by_name[rover].type not in explorers:
            continue
        for meeting in situation.meetings:
            come, drive = draft.travel(rover, meeting), draft.travel(carrier, meeting)
            if come is not None and drive is not None:
                meet = max(ready_ms[rover] + come, ready_ms[carrier] + drive)
                busy = any(a.name is ActionName.EXPLORE and a.robot == rover for a in draft.timeline.actions)
                options.append((busy, meet, rover, meeting))
    load = sum(robot.carrier == carrier for robot in situation.robots)
    if load >= situation.type_of(carrier).capacity or not options:
        return None
    _, _, rover, meeting = min(options)
    waiting.remove(rover)
    draft.timeline.dock(rover, carrier, meeting)
    return rover
