"""Takes a plan from the moment it was made for to a later one.

Meanwhile robots have moved on, targets have shifted or gone, and names may have changed: what still makes sense of the
plan is put on the clock again, and only what the checker accepts comes out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from marsupial.maps.targets import Target
from marsupial.model.plan import Action, Plan
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.list_scheduling.timeline import Timeline


def shifted(plan: Plan, by_ms: int) -> Plan:
    """Return `plan` with every start `by_ms` later."""
    return Plan(actions=tuple(replace(action, start_ms=action.start_ms + by_ms) for action in plan.actions))


def tolerance_cells(explorers: Iterable[str], ranges_cells: Mapping[str, float]) -> float:
    """Return how far a target may shift, in cells, and still count as the same: half the shortest sensor range."""
    return 0.5 * min(ranges_cells[name] for name in explorers)


def same_target(target: Target, others: Sequence[Target], ranges_cells: Mapping[str, float]) -> Target | None:
    """Return the nearest of `others` that `target` may have turned into, or None."""
    limit = tolerance_cells(target.viewpoints, ranges_cells)
    x, y = target.cell
    best: tuple[int, str] | None = None
    found = None
    for other in others:
        apart = (other.cell.x - x) ** 2 + (other.cell.y - y) ** 2
        if apart > limit * limit or (best is not None and (apart, other.name) >= best):
            continue
        if not target.viewpoints.keys().isdisjoint(other.viewpoints):
            best, found = (apart, other.name), other
    return found


def same_targets(
    targets: Iterable[Target], others: Sequence[Target], ranges_cells: Mapping[str, float]
) -> list[Target | None]:
    """Return `same_target` of each; most of them have not moved, and that is seen at once."""
    there = {other.cell: other for other in others}
    found: list[Target | None] = []
    for target in targets:
        other = there.get(target.cell)
        if other is None or target.viewpoints.keys().isdisjoint(other.viewpoints):
            other = same_target(target, others, ranges_cells)
        found.append(other)
    return found


def carried_over(actions: Sequence[Action], situation: Situation, renamed: Mapping[str, str]) -> Plan | None:
    """Return what is left of a plan, made to fit `situation`; None if that is nothing or no longer valid.

    Parameters
    ----------
    actions
        In plan order; only their names and places count.
    renamed
        New names of the targets that still exist, by old name. Meetings and homes keep theirs.
    """
    timeline = Timeline.of(situation)
    places = situation.meetings + situation.homes
    for action in actions:
        place = action.place if action.place in places else renamed.get(action.place)
        if place is None or not timeline.at.keys() >= set(action.robots):
            continue
        fitted = replace(action, place=place)
        if timeline.can(fitted):
            timeline.add(fitted)
    plan = timeline.plan
    if not plan.actions or not check(situation, plan, targets=plan.explored).valid:
        return None
    return plan
