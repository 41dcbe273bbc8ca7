"""Fits a plan to a situation later than its own.

Meanwhile robots have moved, and targets have shifted or disappeared. `same_targets` matches old targets with new ones,
and `carried_over` reschedules the actions that are still possible. The checker decides whether the result is valid.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from marsupial.maps.targets import Target
from marsupial.model import Action, Plan, Situation
from marsupial.planning.checker import check
from marsupial.planning.schedule.timeline import Timeline


def shifted(plan: Plan, by_ms: int) -> Plan:
    """Return `plan` with every start `by_ms` later."""
    return Plan(actions=tuple(replace(action, start_ms=action.start_ms + by_ms) for action in plan.actions))


def same_target(target: Target, others: Sequence[Target], ranges_cells: Mapping[str, float]) -> Target | None:
    """Return the nearest of `others` that counts as the same target, or None.

    A target may move by half of its explorers' shortest range and still be the same.
    """
    limit, (x, y) = 0.5 * min(ranges_cells[name] for name in target.viewpoints), target.cell
    apart = {other.name: (other.cell.x - x) ** 2 + (other.cell.y - y) ** 2 for other in others}
    near = (other for other in others if apart[other.name] <= limit * limit)
    same = (other for other in near if not target.viewpoints.keys().isdisjoint(other.viewpoints))
    return min(same, key=lambda other: (apart[other.name], other.name), default=None)


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


def renamed(targets: Sequence[Target], others: Sequence[Target], ranges_cells: Mapping[str, float]) -> dict[str, str]:
    """Return the names among `others` of the targets that still exist, by their former name."""
    now = same_targets(targets, others, ranges_cells)
    return {old.name: new.name for old, new in zip(targets, now, strict=True) if new is not None}


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
