"""Plans that no battery spoils: sorties are put off until rovers are charged, and rovers are picked up in time.

A plan made as if batteries had no limit is added to a timeline action by action, in its order. An action is only added
if every rover on the ground could afterwards still be picked up in time, which is tried with a pick-up of all rovers
(`marsupial.planning.list_scheduling.recovery`). So there is always a way to save all rovers, whatever is added, and
whoever follows the plan up to any moment has it then. What can't be added waits for the actions of other robots. If
nothing can be added, the rovers in danger are picked up, or those aboard wait until they are charged; what is still not
possible then is left out, and its targets are tried again once rovers are charged.

Levels are kept above a reserve (`RESERVE`), since robots are late at times, unless a rover has less from the start.
Rovers that can't be saved even at once are left aside.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np

from marsupial.model import Action, ActionName, Plan, Role, Situation
from marsupial.planning.list_scheduling.costs import NEVER, Costs, Detours
from marsupial.planning.list_scheduling.insertions import Insertions
from marsupial.planning.list_scheduling.recovery import go_home, recover
from marsupial.planning.list_scheduling.timeline import Timeline, Transport, transport

_ROUNDING = 1e-9  # of sums of shares

RESERVE = 0.1
"""Share of a battery's capacity that plans keep."""


@dataclass(slots=True)
class Charges:
    """The charge of each battery in J at a time in ms, after the actions so far."""

    situation: Situation
    level_j: dict[str, float]
    since_ms: dict[str, int]
    aboard: set[str]
    least_j: dict[str, float]  # the least charge that each has had on the ground

    @classmethod
    def of(cls, situation: Situation) -> Charges:
        """Return the charges before any action."""
        robots = [situation.robot_by_name[name] for name in situation.batteries]
        levels = {robot.name: situation.charge_j(robot.name) for robot in robots}
        since_ms = {robot.name: robot.free_at_ms for robot in robots}
        aboard = {robot.name for robot in robots if robot.carrier is not None}
        least_j = {name: math.inf if name in aboard else level for name, level in levels.items()}
        return cls(situation, levels, since_ms, aboard, least_j)

    def copy(self) -> Charges:
        """Return a copy that can be continued differently."""
        return Charges(self.situation, dict(self.level_j), dict(self.since_ms), set(self.aboard), dict(self.least_j))

    def at(self, rover: str, t_ms: int) -> float:
        """Return the charge at a time after the actions so far, if the rover stays where it is."""
        battery, past_s = self.situation.batteries[rover], (t_ms - self.since_ms[rover]) / 1000
        if rover in self.aboard:
            return min(battery.capacity_j, self.level_j[rover] + battery.charge_w * past_s)
        return self.level_j[rover] - battery.stand_w * past_s

    def lasting_s(self, rover: str) -> float:
        """Return how long the charge of a rover lasts if it stands."""
        stand_w = self.situation.batteries[rover].stand_w
        return self.level_j[rover] / stand_w if stand_w else math.inf

    def full_ms(self, rover: str, wanted_j: float) -> int | None:
        """Return when a rover aboard has a charge; None if never."""
        battery, lacking_j = self.situation.batteries[rover], wanted_j - self.level_j[rover]
        if lacking_j <= 0:
            return self.since_ms[rover]
        if not battery.charge_w or wanted_j > battery.capacity_j:
            return None
        return self.since_ms[rover] + int(-(-1000 * lacking_j // battery.charge_w)) + 1

    def add(self, actions: Iterable[Action]) -> None:
        """Add actions, in order for each rover."""
        for action in actions:
            rover = action.robot
            if rover not in self.level_j:
                continue
            battery = self.situation.batteries[rover]
            power_w = battery.drive_w if action.carrier is None else battery.stand_w
            self.level_j[rover] = self.at(rover, action.start_ms) - power_w * action.duration_ms / 1000
            self.since_ms[rover] = action.end_ms
            self.least_j[rover] = min(self.least_j[rover], self.level_j[rover])
            if action.name is ActionName.DOCK:
                self.aboard.add(rover)
            else:
                self.aboard.discard(rover)


class _Draft:
    """A timeline, and the charges after the first `seen` of its actions."""

    def __init__(self, timeline: Timeline, charges: Charges, seen: int = 0) -> None:
        self.timeline, self.charges, self._seen = timeline, charges, seen

    def copy(self) -> _Draft:
        return _Draft(self.timeline.copy(), self.charges.copy(), self._seen)

    def caught_up(self) -> _Draft:
        """Return this after charges have caught up with the timeline."""
        self.charges.add(self.timeline.actions[self._seen :])
        self._seen = len(self.timeline.actions)
        return self

    def with_timeline(self, timeline: Timeline) -> _Draft:
        """Return a draft with a timeline that continues this one's."""
        return _Draft(timeline, self.charges.copy(), self._seen).caught_up()

    def with_actions(self, actions: Iterable[Action]) -> _Draft:
        """Return a draft with actions added, as far as they are possible."""
        draft = self.copy()
        for action in actions:
            if draft.timeline.can(action):
                draft.timeline.add(action)
        return draft.caught_up()

    def charged(self, rover: str, wanted_j: float) -> bool:
        """Let a rover aboard wait until it has a charge; return whether that changes when it can be set down."""
        ready_ms = self.charges.full_ms(rover, min(wanted_j, self.charges.situation.batteries[rover].capacity_j))
        carrier = self.timeline.on[rover]
        free_ms = max(self.timeline.ready_ms[name] for name in (rover, carrier or rover))
        if ready_ms is None or ready_ms <= free_ms:
            return False
        self.timeline.ready_ms[rover] = ready_ms
        return True


def _sortie(rover: str, actions: Iterable[Action]) -> list[Action]:
    """Return the drives of a rover among these actions before it docks."""
    own = (action for action in actions if action.robot == rover)
    return list(takewhile(lambda action: action.carrier is None, own))


def _first_explore(sortie: Sequence[Action]) -> int:
    """Return the index of the first target in a sortie, or its length."""
    return next((i for i, action in enumerate(sortie) if action.name is ActionName.EXPLORE), len(sortie))


class BatteryPlanner:
    """Makes plans for one situation keep its batteries charged; `kept_in` is the only use of it."""

    def __init__(self, situation: Situation, reserve: float = RESERVE) -> None:
        self._situation = situation
        self._detours = Detours(situation)
        self._costs = Costs(self._detours.situation)
        self._floors_j = {name: reserve * battery.capacity_j for name, battery in situation.batteries.items()}
        start = _Draft(Timeline.of(self._detours.situation), Charges.of(situation))
        for floor_j in (0.0, -math.inf):
            for rover in self._endangered(start):
                self._floors_j[rover] = floor_j
        self._start = start

    def kept(self, plan: Plan) -> tuple[Plan, frozenset[str]]:
        """Return the plan if all its rovers can be saved at its end, or else one changed so that they can be.

        A plan without actions becomes the pick-up of all rovers. If the goal has rovers aboard, so has the plan. The
        second value are the meeting points of a pick-up of all rovers at its end.
        """
        draft = self._replayed(plan)
        if draft is None or self._endangered(draft):
            draft = self._decoded(plan)
        goal, out = self._situation.goal, any(draft.timeline.on[rover] is None for rover in self._floors_j)
        if out and (goal.aboard or not plan.actions):
            draft = self._picked_up(draft)
            if goal.return_home:
                go_home(draft.timeline)
        elif goal.return_home and draft.timeline.plan != plan:
            go_home(draft.timeline)
        rescue = self._recovered(draft).timeline.actions[len(draft.timeline.actions) :]
        meetings = frozenset(action.place for action in rescue if action.carrier is not None)
        return self._detours.expanded(draft.timeline.plan), meetings

    def _replayed(self, plan: Plan) -> _Draft | None:
        """Return the draft with the plan as it is; None if the times of its actions are not the earliest."""
        timeline = Timeline.of(self._detours.situation)
        for action in plan.actions:
            timeline.add(action)
        return _Draft(timeline, Charges.of(self._situation)).caught_up() if timeline.plan == plan else None

    def _recovered(self, draft: _Draft) -> _Draft:
        """Return the draft with all rovers picked up if possible, the soonest or the most urgent first."""
        soonest = draft.with_timeline(recover(draft.timeline.copy(), self._costs)[0])
        if not self._lacking(soonest):
            return soonest
        urgent = draft.copy()
        out = [rover for rover in self._floors_j if draft.timeline.on[rover] is None]
        for rover in sorted(out, key=lambda rover: draft.charges.lasting_s(rover)):
            self._pick_up(urgent, rover)
        urgent = urgent.with_timeline(recover(urgent.timeline, self._costs)[0])
        return min(soonest, urgent, key=lambda one: len(self._lacking(one)))

    def _pick_up(self, draft: _Draft, rover: str) -> None:
        """Add the soonest pick-up of a rover on the ground, if there is one."""
        timeline, situation = draft.timeline, self._detours.situation
        docks = [
            (max(rover_ms, carrier_ms), carrier.name, meeting)
            for carrier in situation.of_role(Role.CARRIER)
            if not timeline.is_full(carrier.name)
            for meeting in situation.meetings
            if (rover_ms := timeline.ready_at(rover, meeting)) is not None
            and (carrier_ms := timeline.ready_at(carrier.name, meeting)) is not None
        ]
        if docks:
            _, carrier, meeting = min(docks)
            timeline.dock(rover, carrier, meeting)

    def _picked_up(self, draft: _Draft) -> _Draft:
        """Return the draft with all rovers picked up whose charge suffices."""
        saved = self._recovered(draft)
        left = {rover for rover, least_j in saved.charges.least_j.items() if least_j < 0}
        actions = saved.timeline.actions[len(draft.timeline.actions) :]
        return draft.with_actions(action for action in actions if action.robot not in left)

    def _endangered(self, draft: _Draft) -> list[str]:
        """Return the rovers that have too little charge somewhere, or if they are all picked up."""
        saved = self._lacking(self._recovered(draft))
        return [rover for rover in self._floors_j if rover in saved or draft.charges.least_j[rover] < 0]

    def _lacking(self, saved: _Draft) -> list[str]:
        """Return the rovers that have too little charge, or are not aboard."""
        return [
            rover
            for rover, floor_j in self._floors_j.items()
            if saved.charges.least_j[rover] < floor_j or (saved.timeline.on[rover] is None and floor_j > -math.inf)
        ]

    def _decoded(self, plan: Plan) -> _Draft:
        """Return a draft with as much of the plan as batteries allow."""
        draft, pending, left = self._start.copy(), list(plan.actions), 4 * len(plan.actions) + 10
        while pending and left:
            left -= 1
            draft, pending, endangered = self._pass(draft, pending)
            if not pending:
                break
            rescued = self._with_rescue(draft, endangered)
            if rescued is not None:
                draft = rescued
            elif not self._charge_one(draft, pending):
                pending.pop(0)
        draft = self._with_targets(draft, sorted(plan.explored - draft.timeline.explored))
        # without the rest of the plan, drives to meeting points lead nowhere
        done = {action.name for action in draft.timeline.actions}
        return self._start.copy() if plan.explored and done == {ActionName.MOVE} else draft

    def _pass(self, draft: _Draft, pending: list[Action]) -> tuple[_Draft, list[Action], list[str]]:
        """Add the actions that leave nobody in danger; return the draft, the others, and whom those would endanger."""
        blocked: set[str] = set()
        kept: list[Action] = []
        endangered: dict[str, None] = {}
        for i, action in enumerate(pending):
            if not blocked.isdisjoint(action.robots):
                blocked.update(action.robots)
                kept.append(action)
                continue
            if not draft.timeline.can(action):
                continue
            tried = [action]
            if action.name is ActionName.UNDOCK and action.robot in self._floors_j:
                sortie = _sortie(action.robot, pending[i + 1 :])
                draft.charged(action.robot, self._needed_j(action.robot, sortie))
                tried += sortie[: 1 + _first_explore(sortie)]  # or the rover would be set down for nothing
            after = draft.with_actions([action])
            if danger := self._endangered(draft.with_actions(tried)):
                blocked.update(action.robots)
                kept.append(action)
                endangered |= dict.fromkeys(danger)
            else:
                draft = after
        return draft, kept, list(endangered)

    def _needed_j(self, rover: str, sortie: Iterable[Action]) -> float:
        """Return the charge that a rover needs for a sortie: for its drives, and the reserve twice."""
        battery = self._situation.batteries[rover]
        driven_s = sum(action.duration_ms for action in sortie) / 1000
        return battery.drive_w * driven_s + 2 * RESERVE * battery.capacity_j

    def _with_rescue(self, draft: _Draft, rovers: Iterable[str]) -> _Draft | None:
        """Return the draft with these rovers picked up; None if none of them is on the ground."""
        out = {rover for rover in rovers if draft.timeline.on[rover] is None}
        saved = self._recovered(draft).timeline
        new = saved.actions[len(draft.timeline.actions) :]
        ends = [i for i, action in enumerate(new) if action.name is ActionName.DOCK and action.robot in out]
        if not ends:
            return None
        timeline = draft.timeline.copy()
        for action in new[: ends[-1] + 1]:
            timeline.add(action)
        return draft.with_timeline(timeline)

    def _charge_one(self, draft: _Draft, pending: Iterable[Action]) -> bool:
        """Let the next rover to be set down charge fully; return whether that changes anything."""
        rovers = (action.robot for action in pending if action.name is ActionName.UNDOCK)
        return any(draft.charged(rover, math.inf) for rover in rovers if rover in self._floors_j)

    def _with_targets(self, draft: _Draft, targets: Iterable[str]) -> _Draft:
        """Return the draft with further targets explored as far as possible, each as soon as it can be.

        A sortie from the nearest meeting point, by a rover that is charged, takes the least energy: it comes last.
        """
        for target in targets:
            options = (one for one in (draft.copy(), self._all_charged(draft)) if self._explore(one.timeline, target))
            found = [one for one in options if not self._endangered(one.caught_up())]
            found = found or [*self._sorties(draft, target)] or [*self._sorties(self._recovered(draft), target)]
            if found:
                draft = min(found, key=lambda one: one.timeline.actions[-1].end_ms)
        return draft

    def _all_charged(self, draft: _Draft) -> _Draft:
        draft = draft.copy()
        for rover in self._floors_j:
            if draft.timeline.on[rover] is not None:
                draft.charged(rover, math.inf)
        return draft

    def _sorties(self, draft: _Draft, target: str) -> Iterator[_Draft]:
        """Yield a draft for each rover aboard that can explore a target, with its carrier waiting at the end."""
        for rover in self._floors_j:
            after = draft.copy()
            carrier, kind = after.timeline.on[rover], self._situation.robot_by_name[rover].type
            if carrier is None or kind not in self._situation.target_by_name[target].explorers:
                continue
            start, end = self._nearest(kind, target, out=True), self._nearest(kind, target, out=False)
            if start is None or end is None:
                continue
            after.charged(rover, math.inf)
            stage = Transport(carrier, pickup=None, set_down=start, then_to=start)
            if not transport(after.timeline, rover, stage) or not after.timeline.can_drive(carrier, end):
                continue
            after.timeline.explore(rover, target)
            after.timeline.dock(rover, carrier, end)
            if not self._endangered(after.caught_up()):
                yield after

    def _nearest(self, kind: str, target: str, *, out: bool) -> str | None:
        """Return the meeting point from which robots of a type get to a target soonest, or back to; None if to none."""
        situation = self._detours.situation
        ends = (((name, target) if out else (target, name), name) for name in situation.meetings)
        ways = ((situation.travel(kind, *way), name) for way, name in ends)
        return min(((ms, name) for ms, name in ways if ms is not None), default=(0, None))[1]

    def _explore(self, timeline: Timeline, target: str) -> bool:
        """Add the soonest way to explore a target; return False if there is none."""
        names = [one.name for one in timeline.situation.targets]
        insertions = Insertions(timeline, self._costs, np.array([name == target for name in names], dtype=np.bool_))
        done, numbers = insertions.soonest()
        index = names.index(target)
        if done[index] >= NEVER:
            return False
        robot, carrier = insertions.explorer(int(numbers[index]))
        if carrier is not None and not transport(timeline, robot, insertions.journey(robot, carrier, index)):
            return False
        timeline.explore(robot, target)
        return True


def with_batteries(situation: Situation, plan: Plan) -> tuple[Plan, frozenset[str]]:
    """Return a plan for a situation without batteries as one that its batteries allow (`BatteryPlanner.kept`).

    The second value are the meeting points at which rovers can be picked up at its end. They have to stay meeting
    points: others may be out of reach.
    """
    return BatteryPlanner(situation).kept(plan) if situation.batteries else (plan, frozenset())


@dataclass(frozen=True, slots=True)
class Charged:
    """A share of its battery's capacity that a rover waits for aboard, and how much it gains in a millisecond."""

    share: float
    per_ms: float

    def after_ms(self, share: float | None) -> int:
        """Return how long a rover with this share has to wait."""
        lacking = 0.0 if share is None else self.share - share
        return math.ceil(lacking / self.per_ms) if lacking > _ROUNDING and self.per_ms else 0


def charged_first(situation: Situation, plan: Plan) -> dict[Action, Charged]:
    """Return what the undockings of a plan count on: the charges that rovers have then."""
    charges, found = Charges.of(situation), {}
    for action in plan.actions:
        if action.name is ActionName.UNDOCK and (battery := situation.batteries.get(action.robot)) is not None:
            share = charges.at(action.robot, action.start_ms) / battery.capacity_j
            found[action] = Charged(share, battery.charge_w / battery.capacity_j / 1000)
        charges.add((action,))
    return found
