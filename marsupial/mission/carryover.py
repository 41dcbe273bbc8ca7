"""Takes a plan from the moment it was made for to a later one.

Meanwhile robots have moved on, targets have shifted or gone, and names may have changed: what still makes sense of the
plan is put on the clock anew, and only what the checker accepts comes out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from marsupial.maps.targets import Target
from marsupial.model.plan import Action, ActionName, Plan
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


def carried_over(actions: Sequence[Action], situation: Situation, renamed: Mapping[str, str]) -> Plan | None:
    """Return what is left of a plan, made to fit `situation`; None if that is nothing or no longer valid.

    Parameters
    ----------
    actions
        In plan order; only their names and places count.
    renamed
        New names of the targets that still exist, by old name. Meetings and homes keep theirs.
    """
    team = _Team(
        situation=situation,
        at={robot.name: robot.place for robot in situation.robots},
        on={robot.name: robot.carrier for robot in situation.robots},
    )
    places = situation.meetings + situation.homes
    kept: list[Action] = []
    for action in actions:
        place = action.place if action.place in places else renamed.get(action.place)
        if place is None or not team.at.keys() >= set(action.robots):
            continue
        origin = None if action.origin is None else team.at[action.robot]
        fitted = replace(action, place=place, origin=origin)
        if team.can(fitted):
            team.do(fitted)
            kept.append(fitted)
    plan = retime(situation, kept)
    if not kept or not check(situation, plan, targets=plan.explored).valid:
        return None
    return plan


@dataclass(slots=True)
class _Team:
    """Where everybody is after the actions kept so far, and what has been explored."""

    situation: Situation
    at: dict[str, str | None]
    on: dict[str, str | None]
    explored: set[str] = field(default_factory=set)

    def can(self, action: Action) -> bool:
        """Say whether `action` makes sense now."""
        robot, carrier = action.robot, action.carrier
        if carrier is None:
            return self._can_drive(action)
        if self.at[carrier] != action.place:
            return False
        if action.name is ActionName.UNDOCK:
            return self.on[robot] == carrier
        load = sum(on == carrier for on in self.on.values())
        return self.at[robot] == action.place and load < self.situation.type_of(carrier).capacity

    def do(self, action: Action) -> None:
        """Enter the effects of `action`."""
        docked = action.name is ActionName.DOCK
        self.at[action.robot] = None if docked else action.place
        self.on[action.robot] = action.carrier if docked else None
        if action.name is ActionName.EXPLORE:
            self.explored.add(action.place)

    def _can_drive(self, action: Action) -> bool:
        if action.origin in (None, action.place) or action.place in self.explored:
            return False
        kind = self.situation.robot_by_name[action.robot].type
        return self.situation.travel(kind, str(action.origin), action.place) is not None
