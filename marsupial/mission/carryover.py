"""Fits a plan to a later situation than the one it was made for.

Meanwhile robots have moved and targets have shifted or gone. `same_targets` matches old targets with new ones, and
`carried_over` schedules the actions that are still possible anew. The checker decides whether the result is valid.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from marsupial.maps.targets import Target
from marsupial.model import Action, Plan, Situation
from marsupial.planning.checker import check
from marsupial.planning.list_scheduling.timeline import Timeline


def shifted(plan: Plan, by_ms: int) -> Plan:
    """Return `plan` with every start `by_ms` later."""
    return Plan(actions=tuple(replace(action, start_ms=action.start_ms + by_ms) for action in plan.actions))


def tolerance_cells(explorers: Iterable[str], ranges_cells: Mapping[str, float]) -> float:
    """Return how far a target may move and still be the same, in cells: half of its explorers' shortest range."""
    return 0.5 * min(ranges_cells[name] for name in explorers)


def same_target(target: Target, others: Sequence[Target], ranges_cells: Mapping[str, float]) -> Target | None:
    """Return the nearest of `others` that counts as the same target, or None."""
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
    """Return `same_target` of each of `targets`."""
    # most targets have not moved, so look up their cell first
    there = {other.cell: other for other in others}
    found: list[Target | None] = []
    for target in targets:
        other = there.get(target.cell)
        if other is None or target.viewpoints.keys().isdisjoint(other.viewpoints):
            other = same_target(target, others, ranges_cells)
        found.append(other)
    return found


def carried_over(actions: Sequence[Action], situation: Situation, renamed: Mapping[str, str]) -> Plan | None:
    """Return the rest of a plan, fitted to `situation`; None if nothing is left or the rest is invalid.

    The `actions` are in plan order; their times are ignored. `renamed` has the new names of the targets that still
    exist; meeting points and homes keep their names.
    """
    timeline = Timeline.of(situation)
    places = situation.meetings + situation.homes
    for action in actions:
        place = action.place if action.place in places else renamed.get(action.place)
        # the target is gone, or a robot of the action is lost
        if place is None or not timeline.at.keys() >= set(action.robots):
            continue
        fitted = replace(action, place=place)
        # skipped actions can make later ones impossible: a rover that was not picked up can't be set down
        if timeline.can(fitted):
            timeline.add(fitted)
    plan = timeline.plan
    if not plan.actions or not check(situation, plan, targets=plan.explored).valid:
        return None
    return plan
