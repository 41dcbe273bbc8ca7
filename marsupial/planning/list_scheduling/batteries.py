"""Plans that batteries suffice for: sorties wait until robots are charged, and all robots can be saved in time.

A plan made as if batteries had no limit is added to a timeline action by action, in its order. An action is only added
if all robots could be saved afterwards: if every rover on the ground could be picked up or, without a place aboard, get
to a charging place, and every carrier with a battery could get to one (or else home), before any battery is empty. That
is tried by adding these actions (`marsupial.planning.list_scheduling.recovery`), in a mission after the end of the
plan. So whoever follows the plan can save all robots at any time. What can't be added waits for the actions of other
robots. If nothing can be added, the robots in danger are saved, or robots that are charging wait until they are full;
what is still not possible then is left out, and its targets are tried again at the end.

Levels are kept above a reserve (`RESERVE`), since robots are late at times, unless a robot has less from the start.
Robots that can't be saved even at once are left aside.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np

from marsupial.model import Action, ActionName, Plan, RobotState, Role, Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.list_scheduling.charges import Charges
from marsupial.planning.list_scheduling.costs import NEVER, Costs, Detours
from marsupial.planning.list_scheduling.insertions import Insertions
from marsupial.planning.list_scheduling.recovery import go_home, recover
from marsupial.planning.list_scheduling.timeline import Timeline, Transport, transport

RESERVE = 0.1
"""Share of a battery's capacity that plans keep."""


class _Draft:
    """A timeline with the charges along it."""

    def __init__(self, timeline: Timeline, charges: Charges) -> None:
        self.timeline, self.charges = timeline, charges

    def copy(self) -> _Draft:
        return _Draft(self.timeline.copy(), self.charges.copy())

    def caught_up(self) -> _Draft:
        """Return this after charges have caught up with the timeline."""
        self.charges.catch_up(self.timeline.actions)
        return self

    def with_timeline(self, timeline: Timeline) -> _Draft:
        """Return a draft with a timeline that continues this one's."""
        return _Draft(timeline, self.charges.copy()).caught_up()

    def with_actions(self, actions: Iterable[Action]) -> _Draft:
        """Return a draft with actions added, as far as they are possible."""
        draft = self.copy()
        for action in actions:
            if draft.timeline.can(action):
                draft.timeline.add(action)
        return draft.caught_up()

    def charged(self, robot: str, wanted_j: float = math.inf) -> bool:
        """Let a robot that is charging wait until it has a charge; return whether it then acts later."""
        if not self.charges.charging(robot):
            return False
        ready_ms = self.charges.charged_ms(robot, wanted_j)
        free_ms = max(self.timeline.ready_ms[name] for name in (robot, self.timeline.on[robot] or robot))
        if ready_ms is None or ready_ms <= free_ms:
            return False
        self.timeline.ready_ms[robot] = ready_ms
        return True


def _at_end(draft: _Draft) -> _Draft:
    """Return the draft with all robots ready at its end only."""
    after = draft.copy()
    end_ms = max((action.end_ms for action in after.timeline.actions), default=0)
    after.timeline.ready_ms = {name: max(ms, end_ms) for name, ms in after.timeline.ready_ms.items()}
    return after


def _sortie(rover: str, actions: Iterable[Action]) -> list[Action]:
    """Return the drives of a rover among these actions before it docks."""
    own = (action for action in actions if action.robot == rover)
    return list(takewhile(lambda action: action.carrier is None, own))


def _first_explore(sortie: Sequence[Action]) -> int:
    """Return the index of the first target in a sortie, or its length."""
    return next((i for i, action in enumerate(sortie) if action.name is ActionName.EXPLORE), len(sortie))


def _refuges(situation: Situation, carrier: RobotState) -> tuple[str, ...]:
    """Return where a carrier with a battery has to be able to get to: charging places, or else its home."""
    return situation.chargers or (() if carrier.home is None else (carrier.home,))


class BatteryPlanner:
    """Makes plans for one situation keep a `reserve` in all batteries."""

    def __init__(self, situation: Situation, reserve: float = RESERVE) -> None:
        self._situation = situation
        self._detours = Detours(situation)
        self._costs = Costs(self._detours.situation)
        self._rovers = [robot.name for robot in situation.of_role(Role.ROVER) if robot.name in situation.batteries]
        start = _Draft(Timeline.of(self._detours.situation), Charges.of(situation))
        # per carrier with a battery, where it is safe and can get to
        self._refuges = {
            robot.name: [name for name in _refuges(situation, robot) if start.timeline.can_drive(robot.name, name)]
            for robot in situation.of_role(Role.CARRIER)
            if robot.name in situation.batteries
        }
        self._floors_j = {name: reserve * battery.capacity_j for name, battery in situation.batteries.items()}
        for floor_j in (0.0, -math.inf):
            for robot in self._endangered(start):
                self._floors_j[robot] = floor_j
        self._start = start

    def kept(self, plan: Plan) -> Plan:
        """Return the plan if all its robots can be saved at its end, or else one changed so that they can be.

        A plan without actions becomes the rescue of all robots. If the goal has rovers aboard, so has the plan.
        """
        return self._detours.expanded(self._kept(plan).timeline.plan)

    def kept_with_rescue(self, plan: Plan) -> tuple[Plan, frozenset[str]]:
        """Return what `kept` does, and the meeting points of a rescue at its end."""
        draft = self._kept(plan)
        return self._detours.expanded(draft.timeline.plan), self._rescue_meetings(draft)

    def _kept(self, plan: Plan) -> _Draft:
        draft = self._replayed(plan)
        if draft is None or self._endangered(draft):
            draft = self._decoded(plan)
        goal = self._situation.goal
        if not plan.actions or (goal.aboard and any(draft.timeline.on[rover] is None for rover in self._rovers)):
            draft = self._rescued(draft)
        if goal.return_home and draft.timeline.plan != plan:
            go_home(draft.timeline)
        return draft

    def _rescue_meetings(self, draft: _Draft) -> frozenset[str]:
        """Return the meeting points of a rescue after a draft; none while all batteries stay half full in it."""
        saved, batteries = self._rescue(draft), self._situation.batteries
        if all(saved.charges.least_j[name] >= battery.capacity_j / 2 for name, battery in batteries.items()):
            return frozenset()
        rescue = saved.timeline.actions[len(draft.timeline.actions) :]
        return frozenset(action.place for action in rescue if action.carrier is not None)

    def _replayed(self, plan: Plan) -> _Draft | None:
        """Return the draft with the plan as it is; None if the times of its actions are not the earliest."""
        timeline = Timeline.of(self._detours.situation)
        for action in plan.actions:
            timeline.add(action)
        return _Draft(timeline, Charges.of(self._situation)).caught_up() if timeline.plan == plan else None

    def _saved(self, draft: _Draft) -> _Draft:
        """Return the draft with all rovers picked up, the soonest or the most urgent first, and carriers at refuges."""
        soonest = self._at_refuges(draft.with_timeline(recover(draft.timeline.copy(), self._costs)[0]))
        if not self._lacking(soonest):
            return soonest
        urgent = draft.copy()
        out = [rover for rover in self._rovers if draft.timeline.on[rover] is None]
        for rover in sorted(out, key=draft.charges.lasting_s):
            self._pick_up(urgent, rover)
        urgent = self._at_refuges(urgent.with_timeline(recover(urgent.timeline, self._costs)[0]))
        return min(soonest, urgent, key=lambda one: len(self._lacking(one)))

    def _pick_up(self, draft: _Draft, rover: str) -> None:
        """Add the soonest pick-up of a rover on the ground that its charge suffices for, or that with least energy."""
        timeline, situation = draft.timeline, self._detours.situation
        docks = []
        for meeting in situation.meetings:
            there_ms = timeline.ready_at(rover, meeting)
            for carrier in situation.of_role(Role.CARRIER) if there_ms is not None else ():
                carrier_ms = timeline.ready_at(carrier.name, meeting)
                if there_ms is not None and carrier_ms is not None and timeline.has_place(carrier.name, rover):
                    docked_ms = max(there_ms, carrier_ms) + situation.type_of(rover).dock_ms
                    left_j = draft.charges.after_drive(rover, there_ms - timeline.ready_ms[rover], docked_ms)
                    lacking_j = max(0.0, self._floors_j[rover] - left_j)
                    docks.append((lacking_j, docked_ms, carrier.name, meeting))
        if docks:
            _, _, name, meeting = min(docks)
            timeline.dock(rover, name, meeting)

    def _at_refuges(self, draft: _Draft) -> _Draft:
        """Return this draft after robots with a battery have driven to their nearest refuges, if they are not safe."""
        timeline = draft.timeline
        for robot in (*self._refuges, *self._rovers):
            refuges = self._refuges.get(robot, self._situation.chargers)
            ways = [(ready_ms, name) for name in refuges if (ready_ms := timeline.ready_at(robot, name)) is not None]
            if ways and not self._safe(timeline, robot):
                timeline.move(robot, min(ways)[1])
        return draft.caught_up()

    def _rescued(self, draft: _Draft) -> _Draft:
        """Return the draft with all robots saved whose charge suffices."""
        saved = self._rescue(draft)
        left = {robot for robot, least_j in saved.charges.least_j.items() if least_j < 0}
        actions = saved.timeline.actions[len(draft.timeline.actions) :]
        return draft.with_actions(action for action in actions if left.isdisjoint(action.robots))

    def _endangered(self, draft: _Draft) -> list[str]:
        """Return the robots that have too little charge somewhere, or that can't be saved at the end."""
        # in a mission the rescue is no part of the plan: it begins after its end at the earliest
        lacking = self._lacking(self._saved(draft if self._situation.goal.aboard else _at_end(draft)))
        return [robot for robot in self._floors_j if robot in lacking or draft.charges.least_j[robot] < 0]

    def _rescue(self, draft: _Draft) -> _Draft:
        """Return the draft with all robots saved as soon as possible, or in the order of a rescue after its end."""
        soon = self._saved(draft)
        return soon if not self._lacking(soon) else self._saved(_at_end(draft))

    def _lacking(self, saved: _Draft) -> list[str]:
        """Return the robots that have too little charge, or are not safe."""
        return [
            robot
            for robot, floor_j in self._floors_j.items()
            if saved.charges.least_j[robot] < floor_j or (floor_j > -math.inf and not self._safe(saved.timeline, robot))
        ]

    def _safe(self, timeline: Timeline, robot: str) -> bool:
        """Return whether a robot is aboard or at a charging place, or a carrier at its home or without any refuge."""
        if timeline.on[robot] is not None or timeline.at[robot] in self._situation.charging:
            return True
        return robot in self._refuges and (not self._refuges[robot] or timeline.at[robot] in self._refuges[robot])

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
            elif not self._charge_one(draft, pending, endangered):
                pending.pop(0)
        draft = self._with_targets(draft, sorted(plan.explored - draft.timeline.explored))
        # a plan that explores nothing could be made again and again
        return self._rescued(self._start) if plan.explored and not draft.timeline.explored else draft

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
            tried, after = self._together(draft, action, pending[i + 1 :]), draft.with_actions([action])
            if danger := self._endangered(draft.with_actions(tried)):
                blocked.update(action.robots)
                kept.append(action)
                endangered |= dict.fromkeys(danger)
            else:
                draft = after
        return draft, kept, list(endangered)

    def _together(self, draft: _Draft, action: Action, later: Sequence[Action]) -> list[Action]:
        """Return an action with those without which it would be for nothing, once its rover has the charge for them.

        They are the undocking that a carrier drives to, and the first target of the rover that it sets down.
        """
        tried = [action]
        if action.name is ActionName.MOVE:
            then = next((other for other in later if action.robot in other.robots), None)
            if then is None or then.name is not ActionName.UNDOCK:
                return tried
            tried.append(then)
        rover = tried[-1].robot
        if tried[-1].name is ActionName.UNDOCK and rover in self._floors_j:
            sortie = _sortie(rover, later)
            draft.charged(rover, self._needed_j(rover, sortie))
            tried += sortie[: 1 + _first_explore(sortie)]
        return tried

    def _needed_j(self, rover: str, sortie: Iterable[Action]) -> float:
        """Return the charge that a rover needs for a sortie: for its drives, and the reserve twice."""
        battery = self._situation.batteries[rover]
        driven_s = sum(action.duration_ms for action in sortie) / 1000
        return battery.drive_w * driven_s + 2 * RESERVE * battery.capacity_j

    def _with_rescue(self, draft: _Draft, robots: Iterable[str]) -> _Draft | None:
        """Return the draft with these robots saved; None if they are safe already."""
        at_risk = {robot for robot in robots if not draft.charges.charging(robot)}
        new = self._rescue(draft).timeline.actions[len(draft.timeline.actions) :]
        ends = [i for i, action in enumerate(new) if action.robot in at_risk and action.name is not ActionName.EXPLORE]
        return draft.with_actions(new[: ends[-1] + 1]) if ends else None

    def _charge_one(self, draft: _Draft, pending: Iterable[Action], endangered: Iterable[str]) -> bool:
        """Let a robot that could then do more charge fully; return whether that changes anything."""
        rovers = (action.robot for action in pending if action.name is ActionName.UNDOCK)
        return any(draft.charged(robot) for robot in (*rovers, *endangered) if robot in self._floors_j)

    def _with_targets(self, draft: _Draft, targets: Iterable[str]) -> _Draft:
        """Return the draft with further targets explored as far as possible, each as soon as it can be.

        A sortie from the nearest meeting point, by a rover that is charged, takes the least energy: it comes last.
        """
        for target in targets:
            options = (one for one in (draft.copy(), self._all_charged(draft)) if self._explore(one.timeline, target))
            found = [one for one in options if not self._endangered(one.caught_up())]
            found = found or [*self._sorties(draft, target)] or [*self._sorties(self._rescued(draft), target)]
            if found:
                draft = min(found, key=lambda one: one.timeline.actions[-1].end_ms)
        return draft

    def _all_charged(self, draft: _Draft) -> _Draft:
        draft = draft.copy()
        for robot in self._floors_j:
            draft.charged(robot)
        return draft

    def _sorties(self, draft: _Draft, target: str) -> Iterator[_Draft]:
        """Yield a draft for each rover aboard that can explore a target, with its carrier waiting at the end."""
        for rover in self._rovers:
            after = draft.copy()
            carrier, kind = after.timeline.on[rover], self._situation.robot_by_name[rover].type
            if carrier is None or kind not in self._situation.target_by_name[target].explorers:
                continue
            start, end = self._nearest(kind, target, out=True), self._nearest(kind, target, out=False)
            if start is None or end is None:
                continue
            after.charged(rover)
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

    Also return the meeting points at which rovers can be picked up at its end. They have to stay meeting points:
    others may be out of reach.
    """
    if not situation.batteries:
        return plan, frozenset()
    planner, physical = BatteryPlanner(situation), replace(situation, goal=SituationGoal())
    # a robot that all together can't save is left aside, but what it does must not strand it
    for tried in (plan, Plan(actions=())):
        kept, meetings = planner.kept_with_rescue(tried)
        if check(physical, kept, targets=kept.explored).valid:
            return kept, meetings
    return Plan(actions=()), frozenset()
