"""The rescue of all robots at the end of a plan, which tells whether their batteries suffice.

Rovers on the ground are picked up or, without a place aboard, drive to a charging place, and carriers with a battery
drive to one (or else home). That is tried by adding these actions to a timeline
(`marsupial.planning.schedule.recovery`), in a mission after the end of the plan. A robot's charge has to stay
above the reserve, unless it has less from the start; robots that can't be saved even at once are left aside.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Sequence

from marsupial.model import Action, ActionName, RobotState, Role, Situation
from marsupial.planning.schedule.charges import Charges
from marsupial.planning.schedule.costs import Costs
from marsupial.planning.schedule.recovery import recover
from marsupial.planning.schedule.timeline import Timeline


class Draft:
    """A timeline with the charges along it."""

    def __init__(self, timeline: Timeline, charges: Charges) -> None:
        self.timeline, self.charges = timeline, charges

    def copy(self) -> Draft:
        return Draft(self.timeline.copy(), self.charges.copy())

    def caught_up(self) -> Draft:
        """Return this after charges have caught up with the timeline."""
        self.charges.catch_up(self.timeline.actions)
        return self

    def with_timeline(self, timeline: Timeline) -> Draft:
        """Return a draft with a timeline that continues this one's."""
        return Draft(timeline, self.charges.copy()).caught_up()

    def with_actions(self, actions: Iterable[Action]) -> Draft:
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


def _at_end(draft: Draft) -> Draft:
    """Return the draft with all robots ready at its end only."""
    after = draft.copy()
    end_ms = max((action.end_ms for action in after.timeline.actions), default=0)
    after.timeline.ready_ms = {name: max(ms, end_ms) for name, ms in after.timeline.ready_ms.items()}
    return after


def _refuges(situation: Situation, carrier: RobotState) -> tuple[str, ...]:
    """Return where a carrier with a battery has to be able to get to: charging places, or else its home."""
    return situation.chargers or (() if carrier.home is None else (carrier.home,))


class Rescue:
    """Saves the robots of one situation; `begun` and `costs` have its travel tables completed."""

    def __init__(self, situation: Situation, begun: Timeline, costs: Costs, reserve: float) -> None:
        self._situation, self._costs = situation, costs
        self.rovers = [robot.name for robot in situation.of_role(Role.ROVER) if robot.name in situation.batteries]
        self.start = Draft(begun, Charges.of(situation))
        # per carrier with a battery, where it is safe and can get to
        self._refuges = {
            robot.name: [name for name in _refuges(situation, robot) if self.start.timeline.can_drive(robot.name, name)]
            for robot in situation.of_role(Role.CARRIER)
            if robot.name in situation.batteries
        }
        # the charge that each robot has to keep
        self.floors_j = {name: reserve * battery.capacity_j for name, battery in situation.batteries.items()}
        for floor_j in (0.0, -math.inf):
            for robot in self.endangered(self.start):
                self.floors_j[robot] = floor_j

    @property
    def left_aside(self) -> frozenset[str]:
        """The robots that can't be saved, and the rovers aboard them."""
        lost = {robot for robot, floor_j in self.floors_j.items() if floor_j == -math.inf}
        return frozenset(
            robot.name for robot in self._situation.robots if not lost.isdisjoint((robot.name, robot.carrier))
        )

    def endangered(self, draft: Draft) -> list[str]:
        """Return the robots that have too little charge somewhere, or that can't be saved at the end."""
        # in a mission the rescue is no part of the plan: it begins after its end at the earliest
        lacking = self._lacking(self._picked_up(draft if self._situation.goal.aboard else _at_end(draft)))
        return [robot for robot in self.floors_j if robot in lacking or draft.charges.least_j[robot] < 0]

    def saved(self, draft: Draft) -> Draft:
        """Return the draft with all robots saved as soon as possible, or in the order of a rescue after its end."""
        soon = self._picked_up(draft)
        return soon if not self._lacking(soon) else self._picked_up(_at_end(draft))

    def partly_saved(self, draft: Draft) -> Draft:
        """Return the draft with all robots saved whose charge suffices."""
        saved = self.saved(draft)
        left = {robot for robot, least_j in saved.charges.least_j.items() if least_j < 0}
        actions = saved.timeline.actions[len(draft.timeline.actions) :]
        return self._continued(draft, [action for action in actions if left.isdisjoint(action.robots)], left)

    def with_saved(self, draft: Draft, robots: Iterable[str]) -> Draft | None:
        """Return the draft with these robots saved; None if they are safe already."""
        at_risk = {robot for robot in robots if not draft.charges.charging(robot)}
        new = self.saved(draft).timeline.actions[len(draft.timeline.actions) :]
        ends = [i for i, action in enumerate(new) if action.robot in at_risk and action.name is not ActionName.EXPLORE]
        return self._continued(draft, new[: ends[-1] + 1]) if ends else None

    def _continued(self, draft: Draft, actions: Sequence[Action], left: Container[str] = ()) -> Draft:
        """Return the draft with actions of a rescue: after its end if they would endanger robots before.

        `left` are robots that are in danger anyway.
        """
        early = draft.with_actions(actions)
        if all(robot in left for robot in self.endangered(early)):
            return early
        return _at_end(draft).with_actions(actions)

    def meetings_after(self, draft: Draft) -> frozenset[str]:
        """Return the meeting points of a rescue after a draft; none while all batteries stay half full in it."""
        saved, batteries = self.saved(draft), self._situation.batteries
        if all(saved.charges.least_j[name] >= battery.capacity_j / 2 for name, battery in batteries.items()):
            return frozenset()
        rescue = saved.timeline.actions[len(draft.timeline.actions) :]
        return frozenset(action.place for action in rescue if action.carrier is not None)

    def _picked_up(self, draft: Draft) -> Draft:
        """Return the draft with all rovers picked up, the soonest or the most urgent first, and carriers at refuges."""
        soonest = self._at_refuges(draft.with_timeline(recover(draft.timeline.copy(), self._costs)[0]))
        if not self._lacking(soonest):
            return soonest
        urgent = draft.copy()
        out = [rover for rover in self.rovers if draft.timeline.on[rover] is None]
        for rover in sorted(out, key=draft.charges.lasting_s):
            self._pick_up(urgent, rover)
        urgent = self._at_refuges(urgent.with_timeline(recover(urgent.timeline, self._costs)[0]))
        return min(soonest, urgent, key=lambda one: len(self._lacking(one)))

    def _pick_up(self, draft: Draft, rover: str) -> None:
        """Add the soonest pick-up of a rover on the ground that its charge suffices for, or that with least energy."""
        timeline, situation = draft.timeline, draft.timeline.situation
        docks = []
        for meeting in situation.meetings:
            there_ms = timeline.ready_at(rover, meeting)
            for carrier in situation.of_role(Role.CARRIER) if there_ms is not None else ():
                carrier_ms = timeline.ready_at(carrier.name, meeting)
                if there_ms is not None and carrier_ms is not None and timeline.has_place(carrier.name, rover):
                    docked_ms = max(there_ms, carrier_ms) + situation.type_of(rover).dock_ms
                    left_j = draft.charges.after_drive(rover, there_ms - timeline.ready_ms[rover], docked_ms)
                    lacking_j = max(0.0, self.floors_j[rover] - left_j)
                    docks.append((lacking_j, docked_ms, carrier.name, meeting))
        if docks:
            _, _, name, meeting = min(docks)
            timeline.dock(rover, name, meeting)

    def _at_refuges(self, draft: Draft) -> Draft:
        """Return this draft after robots with a battery have driven to their nearest refuges, if they are not safe."""
        timeline = draft.timeline
        for robot in (*self._refuges, *self.rovers):
            refuges = self._refuges.get(robot, self._situation.chargers)
            ways = [(ready_ms, name) for name in refuges if (ready_ms := timeline.ready_at(robot, name)) is not None]
            if ways and not self._safe(timeline, robot):
                timeline.move(robot, min(ways)[1])
        return draft.caught_up()

    def _lacking(self, saved: Draft) -> list[str]:
        """Return the robots that have too little charge, or are not safe."""
        return [
            robot
            for robot, floor_j in self.floors_j.items()
            if saved.charges.least_j[robot] < floor_j or (floor_j > -math.inf and not self._safe(saved.timeline, robot))
        ]

    def _safe(self, timeline: Timeline, robot: str) -> bool:
        """Return whether a robot is aboard or at a charging place, or a carrier at its home or without any refuge."""
        if timeline.on[robot] is not None or timeline.at[robot] in self._situation.charging:
            return True
        return robot in self._refuges and (not self._refuges[robot] or timeline.at[robot] in self._refuges[robot])
