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
- "Nearest" meeting point: nearest to the carrier. If none connects to the target's area, any from which a rover can
  reach it.
- Targets "reachable from the meeting point": those that only rovers can explore, nearest first.
- Which rover is retrieved and where: preferably a rover without targets left, then the rover that can be met soonest. A
  full carrier does not exchange rovers.
- A carrier without a target waits; one that can't serve its target is assigned another.
- Once no target is left, rovers are recovered by list scheduling (`marsupial.strategies.rules`).

References
----------
Wurm et al. 2010, section IV-B, which refers to Stachniss, Robotic Mapping and Exploration, 2009, for the assignment.
"""

from collections.abc import Iterable, Mapping, Sequence, Set

import numpy as np

from marsupial.arrays import Floats
from marsupial.model import UNREACHABLE, ActionName, Briefing, Plan, RobotState, Role
from marsupial.planning.matching import least_assignment
from marsupial.planning.schedule.timeline import Timeline
from marsupial.strategies.rules import RuleStrategy

_NO_PATH = 1e12  # cost; more than any travel time


class Heuristic(RuleStrategy):
    """The deployment heuristic of the paper's evaluation."""

    name = "heuristic"

    def explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str]]:
        draft = _Assignments(briefing)
        ground = [r for r in briefing.situation.of_role(Role.ROVER) if r.place is not None]
        draft.rovers_explore({r.name: draft.area(r, briefing.deployed_at.get(r.name)) for r in ground})
        for rover in ground:
            draft.send_back(rover, briefing.deployed_at.get(rover.name))
        stuck = draft.send_carriers()
        return draft.timeline.plan, frozenset(stuck)


class _Assignments:
    """The actions chosen so far, the targets that they serve, and the rovers on the ground not retrieved yet."""

    def __init__(self, briefing: Briefing) -> None:
        self._briefing, self._situation = briefing, briefing.situation
        self.timeline = Timeline.of(briefing.situation)
        self._taken: set[str] = set()
        self._waiting = {r.name for r in self._situation.of_role(Role.ROVER) if r.place is not None}

    def area(self, rover: RobotState, meeting: str | None) -> frozenset[str]:
        """Return the targets of the rover-only areas that `meeting` connects to, or else all for rovers only."""
        carriers = {kind.name for kind in self._situation.types if kind.role is Role.CARRIER}
        targets = self._situation.targets
        mine = {t.name for t in targets if rover.type in t.explorers and not t.explorers & carriers}
        connected = frozenset() if meeting is None else self._briefing.connects.get(meeting, frozenset())
        return frozenset(mine & connected or mine)

    def rovers_explore(self, areas: Mapping[str, Set[str]]) -> None:
        """Assign the targets of their areas to rovers: repeatedly the pair with the earliest arrival."""
        order = sorted(areas)
        targets = sorted(frozenset[str]().union(*areas.values()) - self._taken)
        if not targets:
            return
        mine = np.array([[target in areas[rover] for target in targets] for rover in order])
        there_ms = np.stack([self._arrivals_ms(rover, targets) for rover in order])
        while True:
            left_ms = np.where(mine, there_ms, np.inf)
            first, target = np.unravel_index(left_ms.argmin(), left_ms.shape)
            if np.isinf(left_ms[first, target]):
                return
            # only the arrivals of the rover that was chosen change
            self._explore(order[first], targets[target])
            mine[:, target] = False
            there_ms[first] = self._arrivals_ms(order[first], targets)

    def send_back(self, rover: RobotState, meeting: str | None) -> None:
        """Send a rover to its meeting point, unless it is already there."""
        if meeting is not None and self._travel(rover.name, meeting):
            self.timeline.move(rover.name, meeting)

    def send_carriers(self) -> set[str]:
        """Assign carriers to targets until either runs out; return the targets without a robot."""
        direct = self._briefing.direct_ms()
        free = [robot.name for robot in self._situation.of_role(Role.CARRIER) if robot.name in direct]
        impossible: set[tuple[str, str]] = set()
        while free and (pair := self._cheapest_pair(free, direct, impossible)) is not None:
            if self._serve(*pair):
                free.remove(pair[0])
            else:
                impossible.add(pair)
        return {target for _, target in impossible} - self._taken

    def _explore(self, robot: str, target: str) -> None:
        self.timeline.explore(robot, target)
        self._taken.add(target)

    def _travel(self, robot: str, place: str) -> int | None:
        kind = self._situation.robot_by_name[robot].type
        return self._situation.travel(kind, self.timeline.at[robot] or "", place)

    def _arrivals_ms(self, robot: str, places: Sequence[str]) -> Floats:
        """Return the earliest arrival at n places as (n,), inf where there is no path."""
        index = self._situation.place_index
        table = self._situation.travel_ms[self._situation.robot_by_name[robot].type]
        times = table[index[self.timeline.at[robot] or ""], [index[place] for place in places]]
        return np.where(times == UNREACHABLE, np.inf, self.timeline.ready_ms[robot] + times)

    def _cheapest_pair(
        self, carriers: Sequence[str], direct: Mapping[str, Mapping[str, int]], impossible: Set[tuple[str, str]]
    ) -> tuple[str, str] | None:
        """Return the cheapest pair of the optimal assignment of carriers to open targets without impossible pairs."""
        targets = [t.name for t in self._situation.targets if t.name not in self._taken]
        if not targets:
            return None
        cost = np.full((len(carriers), len(targets)), _NO_PATH)
        for i, carrier in enumerate(carriers):
            for j, target in enumerate(targets):
                if target in direct[carrier] and (carrier, target) not in impossible:
                    cost[i, j] = self.timeline.ready_ms[carrier] + direct[carrier][target]
        rows, columns = least_assignment(cost)
        best = min(zip(cost[rows, columns].tolist(), rows.tolist(), columns.tolist(), strict=True))
        return (carriers[best[1]], targets[best[2]]) if best[0] < _NO_PATH else None

    def _serve(self, carrier: str, target: str) -> bool:
        """Send `carrier` to explore `target`, or to bring a rover that will; return False if impossible."""
        situation = self._situation
        explorers = situation.target_by_name[target].explorers
        if situation.robot_by_name[carrier].type in explorers and self._travel(carrier, target) is not None:
            self._explore(carrier, target)
            return True
        fitting = {kind for kind in explorers if self._nearest_meeting(carrier, target, kind) is not None}
        aboard = [r.name for r in situation.robots if r.carrier == carrier and r.type in fitting]
        rover = aboard[0] if aboard else self._retrieve(carrier, fitting)
        if rover is None:
            return False
        state = situation.robot_by_name[rover]
        meeting = self._nearest_meeting(carrier, target, state.type)
        assert meeting is not None, "a carrier that gets to one meeting point gets to it from the next"
        self.timeline.undock(rover, meeting)
        self.rovers_explore({rover: self.area(state, meeting) | {target}})
        self.send_back(state, meeting)
        return True

    def _nearest_meeting(self, carrier: str, target: str, kind: str) -> str | None:
        """Return the meeting point nearest to the carrier from which a rover of type `kind` reaches the target."""
        # meeting points that connect to the target's area come first: False < True
        options = [
            (target not in self._briefing.connects.get(meeting, frozenset()), travel, meeting)
            for meeting in self._situation.meetings
            if (travel := self._travel(carrier, meeting)) is not None
            and self._situation.travel(kind, meeting, target) is not None
        ]
        return min(options)[2] if options else None

    def _retrieve(self, carrier: str, explorers: Iterable[str]) -> str | None:
        """Send `carrier` to pick up a rover first; return that rover, or None if none is available."""
        situation, ready_ms = self._situation, self.timeline.ready_ms
        aboard = [robot.name for robot in situation.robots if robot.carrier == carrier]
        options = []
        for rover in sorted(self._waiting):
            if situation.robot_by_name[rover].type not in explorers or not situation.has_place(carrier, rover, aboard):
                continue
            for meeting in situation.meetings:
                rover_ms, carrier_ms = self._travel(rover, meeting), self._travel(carrier, meeting)
                if rover_ms is not None and carrier_ms is not None:
                    meet = max(ready_ms[rover] + rover_ms, ready_ms[carrier] + carrier_ms)
                    busy = any(a.name is ActionName.EXPLORE and a.robot == rover for a in self.timeline.actions)
                    options.append((busy, meet, rover, meeting))
        if not options:
            return None
        _, _, rover, meeting = min(options)  # rovers without targets come first: False < True
        self._waiting.remove(rover)
        self.timeline.dock(rover, carrier, meeting)
        return rover
