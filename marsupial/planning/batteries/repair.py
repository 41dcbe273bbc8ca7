"""Plans that batteries suffice for: sorties wait until robots are charged, and all robots can be saved in time.

A plan made as if batteries had no limit is added to a timeline action by action, in its order. An action is only added
if all robots could be saved afterwards: if every rover on the ground could be picked up or, without a place aboard, get
to a charging place, and every carrier with a battery could get to one (or else home), before any battery is empty
(`marsupial.planning.batteries.rescue`). So whoever follows the plan can save all robots at any time. What can't
be added waits for the actions of other robots. If nothing can be added, the robots in danger are saved, or robots that
are charging wait until they are full; what is still not possible then is left out, and its targets are tried again at
the end.

Levels are kept above a reserve (`RESERVE`), since robots are late at times.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np

from marsupial.model import EPSILON_MS, Action, ActionName, Plan, Situation, SituationGoal
from marsupial.planning.batteries.rescue import Draft, Rescue
from marsupial.planning.checker import check
from marsupial.planning.schedule.costs import NEVER, Costs, Detours
from marsupial.planning.schedule.insertions import Insertions
from marsupial.planning.schedule.recovery import go_home
from marsupial.planning.schedule.timeline import Timeline, Transport, transport

RESERVE = 0.1
"""Share of a battery's capacity that plans keep."""


def _sortie(rover: str, actions: Iterable[Action]) -> list[Action]:
    """Return the drives of a rover among these actions before it docks."""
    own = (action for action in actions if action.robot == rover)
    return list(takewhile(lambda action: action.carrier is None, own))


def _first_explore(sortie: Sequence[Action]) -> int:
    """Return the index of the first target in a sortie, or its length."""
    return next((i for i, action in enumerate(sortie) if action.name is ActionName.EXPLORE), len(sortie))


class BatteryPlanner:
    """Makes plans for one situation keep a `reserve` in all batteries."""

    def __init__(self, situation: Situation, reserve: float = RESERVE) -> None:
        self._situation = situation
        self._detours = Detours(situation)
        self._costs = Costs(self._detours.situation)
        self._rescue = Rescue(situation, Timeline.of(self._detours.situation), self._costs, reserve)

    @property
    def left_aside(self) -> frozenset[str]:
        """The robots that can't be saved, and the rovers aboard them."""
        return self._rescue.left_aside

    def kept(self, plan: Plan) -> Plan:
        """Return the plan if all its robots can be saved at its end, or else one changed so that they can be.

        A plan without actions becomes the rescue of all robots. If the goal has rovers aboard, so has the plan.
        """
        return self._detours.expanded(self._kept(plan).timeline.plan)

    def kept_with_rescue(self, plan: Plan) -> tuple[Plan, frozenset[str]]:
        """Return what `kept` does, and the meeting points of a rescue at its end."""
        draft = self._kept(plan)
        return self._detours.expanded(draft.timeline.plan), self._rescue.meetings_after(draft)

    def _kept(self, plan: Plan) -> Draft:
        draft = self._replayed(plan)
        if draft is None or self._rescue.endangered(draft):
            draft = self._decoded(plan)
        goal = self._situation.goal
        if not plan.actions or (goal.aboard and any(draft.timeline.on[rover] is None for rover in self._rescue.rovers)):
            draft = self._rescue.partly_saved(draft)
        if goal.return_home and draft.timeline.plan != plan:
            go_home(draft.timeline)
        return draft

    def _replayed(self, plan: Plan) -> Draft | None:
        """Return the draft with the plan as it is; None if the times of its actions are not the earliest."""
        draft = self._rescue.start.copy()
        for action in plan.actions:
            draft.timeline.add(action)
        return draft.caught_up() if draft.timeline.plan == plan else None

    def _decoded(self, plan: Plan) -> Draft:
        """Return a draft with as much of the plan as batteries allow."""
        draft, pending, left = self._rescue.start.copy(), list(plan.actions), 4 * len(plan.actions) + 10
        while pending and left:
            left -= 1
            draft, pending, endangered = self._pass(draft, pending)
            if not pending:
                break
            rescued = self._rescue.with_saved(draft, endangered)
            if rescued is not None:
                draft = rescued
            elif not self._charge_one(draft, pending, endangered):
                pending.pop(0)
        draft = self._with_targets(draft, sorted(plan.explored - draft.timeline.explored))
        # a plan that explores nothing could be made again and again
        return self._rescue.partly_saved(self._rescue.start) if plan.explored and not draft.timeline.explored else draft

    def _pass(self, draft: Draft, pending: list[Action]) -> tuple[Draft, list[Action], list[str]]:
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
            if danger := self._rescue.endangered(draft.with_actions(tried)):
                blocked.update(action.robots)
                kept.append(action)
                endangered |= dict.fromkeys(danger)
            else:
                draft = after
        return draft, kept, list(endangered)

    def _together(self, draft: Draft, action: Action, later: Sequence[Action]) -> list[Action]:
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
        if tried[-1].name is ActionName.UNDOCK and rover in self._rescue.floors_j:
            sortie = _sortie(rover, later)
            draft.charged(rover, self._needed_j(rover, sortie))
            tried += sortie[: 1 + _first_explore(sortie)]
        return tried

    def _needed_j(self, rover: str, sortie: Iterable[Action]) -> float:
        """Return the charge that a rover needs for a sortie: for its drives, and the reserve twice."""
        battery = self._situation.batteries[rover]
        driven_s = sum(action.duration_ms for action in sortie) / 1000
        return battery.drive_w * driven_s + 2 * RESERVE * battery.capacity_j

    def _charge_one(self, draft: Draft, pending: Iterable[Action], endangered: Iterable[str]) -> bool:
        """Let a robot that could then do more charge fully; return whether that changes anything."""
        rovers = (action.robot for action in pending if action.name is ActionName.UNDOCK)
        return any(draft.charged(robot) for robot in (*rovers, *endangered) if robot in self._rescue.floors_j)

    def _with_targets(self, draft: Draft, targets: Iterable[str]) -> Draft:
        """Return the draft extended to explore further targets where possible, each as early as it can be.

        A sortie from the nearest meeting point, by a rover that is charged, takes the least energy: it comes last.
        """
        for target in targets:
            options = (one for one in (draft.copy(), self._all_charged(draft)) if self._explore(one.timeline, target))
            found = [one for one in options if not self._rescue.endangered(one.caught_up())]
            found = (
                found or [*self._sorties(draft, target)] or [*self._sorties(self._rescue.partly_saved(draft), target)]
            )
            if found:
                draft = min(found, key=lambda one: one.timeline.actions[-1].end_ms)
        return draft

    def _all_charged(self, draft: Draft) -> Draft:
        draft = draft.copy()
        for robot in self._rescue.floors_j:
            draft.charged(robot)
        return draft

    def _sorties(self, draft: Draft, target: str) -> Iterator[Draft]:
        """Yield a draft for each rover aboard that can explore a target, with its carrier waiting at the end."""
        for rover in self._rescue.rovers:
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
            if not self._rescue.endangered(after.caught_up()):
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
    planner, nothing = BatteryPlanner(situation), Plan(actions=())
    if (kept := _checked(situation, planner, plan)) is not None:
        return kept
    # a robot that all together can't save is left aside, but what it does must not strand it: a rescue comes first
    rescue = _checked(situation, planner, nothing) or (nothing, frozenset())
    if any(action.duration_ms > EPSILON_MS for action in rescue[0].actions):  # nobody moves in less
        return rescue
    return _by_others(situation, planner, plan) or rescue


def _checked(situation: Situation, planner: BatteryPlanner, plan: Plan) -> tuple[Plan, frozenset[str]] | None:
    """Return the plan kept and the meeting points of a rescue; None if that can't be carried out."""
    kept, meetings = planner.kept_with_rescue(plan)
    physical = replace(situation, goal=SituationGoal())
    return (kept, meetings) if check(physical, kept, targets=kept.explored).valid else None


def _by_others(situation: Situation, planner: BatteryPlanner, plan: Plan) -> tuple[Plan, frozenset[str]] | None:
    """Return what is kept of the part of a plan without the robots left aside; None if there are none."""
    rest, others = situation, planner
    # they may have been the only ones that could save some of the others
    while (left := others.left_aside) and (names := rest.robot_by_name.keys() - left):
        rest = rest.restricted(robots=frozenset(names))
        others = BatteryPlanner(rest)
    if others is planner:
        return None
    part = Plan(actions=tuple(action for action in plan.actions if rest.robot_by_name.keys() >= set(action.robots)))
    free = replace(rest.without_batteries(), goal=SituationGoal())
    valid = check(free, part, targets=part.explored).valid
    return _checked(situation, others, part if valid else Plan(actions=()))
