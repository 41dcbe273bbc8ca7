"""The paper's baseline: carriers are assigned by travel cost alone, rovers are deployed by rule.

Carriers are assigned to targets at the least total travel cost, whether they can explore them or not. A carrier that
can't explore its target goes to the nearest meeting point that connects to it and sets a rover down there; a carrier
without a rover retrieves one first. A rover on the ground explores the targets that its meeting point gives access to
and returns to that point.

The paper leaves some choices open; they are made as follows:

- Assignment: the Hungarian method. Only its cheapest pair is fixed, then the other carriers are assigned again, since a
  rover that is set down serves more than one target. Costs are travel times over ground that any type can drive on
  (`Briefing.direct_ms`), plus the time until a carrier's running action ends.
- Targets that a rover on the ground, or about to be set down, will explore are not assigned to a carrier.
- "Nearest" meeting point: nearest to the carrier. If none connects to the target's area, any from which a rover gets
  there.
- Targets "reachable from the meeting point": those that only rovers can explore, nearest first.
- Which rover is retrieved and where: preferably one without targets left, then the one that can be met soonest. A full
  carrier does not exchange rovers.
- A carrier without a target waits; one that can't serve its target is assigned another.
- Once no target is left, rovers are recovered by list scheduling (`marsupial.strategies.rules`).

References
----------
Wurm et al. 2010, section IV-B, which refers to Stachniss, Robotic Mapping and Exploration, 2009, for the assignment.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field

import numpy as np

from marsupial.arrays import Floats
from marsupial.model import UNREACHABLE, ActionName, Briefing, Plan, RobotState, Role
from marsupial.planning.list_scheduling.timeline import Timeline
from marsupial.planning.matching import least_assignment
from marsupial.strategies.rules import RuleStrategy

_NO_PATH = 1e12  # cost; more than any travel time


class Heuristic(RuleStrategy):
    """The deployment heuristic of the paper's evaluation."""

    name = "heuristic"

    def explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str]]:
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
    """The actions chosen so far and the targets that they serve."""

    timeline: Timeline
    taken: set[str] = field(default_factory=set)

    def explore(self, robot: str, target: str) -> None:
        self.timeline.explore(robot, target)
        self.taken.add(target)

    def travel(self, robot: str, place: str) -> int | None:
        situation = self.timeline.situation
        return situation.travel(situation.robot_by_name[robot].type, self.timeline.at[robot] or "", place)

    def arrivals_ms(self, robot: str, places: Sequence[str]) -> Floats:
        """Return the earliest arrival at n places as (n,), inf where there is no path."""
        index = self.timeline.situation.place_index
        table = self.timeline.situation.travel_ms[self.timeline.situation.robot_by_name[robot].type]
        times = table[index[self.timeline.at[robot] or ""], [index[place] for place in places]]
        return np.where(times == UNREACHABLE, np.inf, self.timeline.ready_ms[robot] + times)


def _area(briefing: Briefing, rover: RobotState, meeting: str | None) -> frozenset[str]:
    """Return the targets of the rover-only areas that `meeting` connects to, or else all for rovers only."""
    situation = briefing.situation
    carriers = {kind.name for kind in situation.types if kind.role is Role.CARRIER}
    mine = {t.name for t in situation.targets if rover.type in t.explorers and not t.explorers & carriers}
    connected = frozenset() if meeting is None else briefing.connects.get(meeting, frozenset())
    return frozenset(mine & connected or mine)


def _rovers_explore(draft: _Assignments, rovers: Iterable[str], areas: Mapping[str, Set[str]]) -> None:
    """Assign the targets of their areas to rovers: repeatedly the pair with the earliest arrival."""
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
        # only the arrivals of the rover that was chosen change
        draft.explore(order[first], targets[target])
        mine[:, target] = False
        there_ms[first] = draft.arrivals_ms(order[first], targets)


def _return(draft: _Assignments, rover: RobotState, meeting: str | None) -> None:
    if meeting is not None and draft.travel(rover.name, meeting):
        draft.timeline.move(rover.name, meeting)


def _send_carriers(briefing: Briefing, draft: _Assignments, waiting: set[str]) -> set[str]:
    """Assign carriers to targets until either runs out; return the targets that no robot could be sent to."""
    situation = briefing.situation
    direct = briefing.direct_ms()
    free = [robot.name for robot in situation.of_role(Role.CARRIER) if robot.name in direct]
    impossible: set[tuple[str, str]] = set()
    while free:
        open_targets = [t.name for t in situation.targets if t.name not in draft.taken]
        pair = _cheapest_pair(free, open_targets, direct, draft, impossible)
        if pair is None:
            break
        carrier, target = pair
        if _serve(briefing, draft, carrier, target, waiting):
            free.remove(carrier)
        else:
            impossible.add(pair)
    return {target for _, target in impossible} - draft.taken


def _cheapest_pair(
    carriers: Sequence[str],
    targets: Sequence[str],
    direct: Mapping[str, Mapping[str, int]],
    draft: _Assignments,
    impossible: Set[tuple[str, str]],
) -> tuple[str, str] | None:
    """Return the cheapest pair of the optimal assignment of carriers to targets without impossible pairs."""
    if not targets:
        return None
    cost = np.full((len(carriers), len(targets)), _NO_PATH)
    for i, carrier in enumerate(carriers):
        for j, target in enumerate(targets):
            if target in direct[carrier] and (carrier, target) not in impossible:
                cost[i, j] = draft.timeline.ready_ms[carrier] + direct[carrier][target]
    rows, columns = least_assignment(cost)
    best = min(zip(cost[rows, columns].tolist(), rows.tolist(), columns.tolist(), strict=True))
    return (carriers[best[1]], targets[best[2]]) if best[0] < _NO_PATH else None


def _serve(briefing: Briefing, draft: _Assignments, carrier: str, target: str, waiting: set[str]) -> bool:
    """Send `carrier` to explore `target` or to bring a rover that does; return False if it can't."""
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
    # meeting points that connect to the target's area come first: False < True
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
    """Send `carrier` to pick up a rover first; return which, or None if none is available."""
    situation, ready_ms = briefing.situation, draft.timeline.ready_ms
    options = []
    for rover in sorted(waiting):
        if situation.robot_by_name[rover].type not in explorers:
            continue
        for meeting in situation.meetings:
            rover_ms, carrier_ms = draft.travel(rover, meeting), draft.travel(carrier, meeting)
            if rover_ms is not None and carrier_ms is not None:
                meet = max(ready_ms[rover] + rover_ms, ready_ms[carrier] + carrier_ms)
                busy = any(a.name is ActionName.EXPLORE and a.robot == rover for a in draft.timeline.actions)
                options.append((busy, meet, rover, meeting))
    load = sum(robot.carrier == carrier for robot in situation.robots)
    if load >= situation.type_of(carrier).capacity or not options:
        return None
    _, _, rover, meeting = min(options)  # rovers without targets come first: False < True
    waiting.remove(rover)
    draft.timeline.dock(rover, carrier, meeting)
    return rover
