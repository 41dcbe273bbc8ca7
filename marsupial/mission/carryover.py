"""Takes a plan from the moment it was made for to a later one.

Meanwhile robots have moved on, targets have shifted or gone, and names may have changed: what still makes sense of the
plan is put on the clock anew, and only what the checker accepts comes out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from marsupial.maps.targets import Target
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.schedule import retime


def shifted(plan: Plan, by_ms: int) -> Plan:
    """Return `plan` with every start `by_ms` later."""
    return Plan(actions=tuple(replace(action, start_ms=action.start_ms + by_ms) for action in plan.actions))


def tolerance_cells(explorers: Iterable[str], ranges_cells: Mapping[str, float]) -> float:
    """Return how far a target may shift, in cells, and still count as the same: half the shortest sensor range."""
    return 0.5 * min(ranges_cells[name] for name in explorers)


def same_target(target: Target, others: Sequence[Target], ranges_cells: Mapping[str, float]) -> Target | None:
    """Return the nearest of `others` that `target` may have turned into, or None."""
    limit = tolerance_cells(target.viewpoints, ranges_cells)
    near = [
        ((other.cell.x - target.cell.x) ** 2 + (other.cell.y - target.cell.y) ** 2, other.name, other)
        for other in others
        if target.viewpoints.keys() & other.viewpoints.keys()
    ]
    near = [entry for entry in near if entry[0] <= limit * limit]
    return min(near)[2] if near else None


def carried_over(actions: Sequence[Action], situation: Situation, renamed: Mapping[str, str]) -> Plan | None:
    """Return what is left of a plan, made to fit `situation`; None if that is nothing or no longer valid.

    Parameters
    ----------
    actions
        In plan order; only their names and places count.
    renamed
        New names of the targets that still exist, by old name. Meetings and homes keep theirs.
    """
    at = {robot.name: robot.place for robot in situation.robots}
    on = {robot.name: robot.carrier for robot in situation.robots}
    roles = {robot.name: situation.type_of(robot.name).role for robot in situation.robots}
    kept: list[Action] = []
    for action in actions:
        place = action.place if action.place in situation.meetings + situation.homes else renamed.get(action.place)
        if place is None or not at.keys() >= set(action.robots):
            continue
        if action.carrier is None:
            if at[action.robot] in (None, place):
                continue
            kept.append(replace(action, place=place, origin=at[action.robot]))
            at[action.robot] = place
        elif action.name is ActionName.DOCK and on[action.robot] is None and roles[action.carrier] is Role.CARRIER:
            kept.append(replace(action, place=place))
            at[action.robot], on[action.robot] = None, action.carrier
        elif action.name is ActionName.UNDOCK and on[action.robot] == action.carrier:
            kept.append(replace(action, place=place))
            at[action.robot], on[action.robot] = place, None
    plan = retime(situation, kept)
    if not kept or not check(situation, plan, targets=plan.explored).valid:
        return None
    return plan
