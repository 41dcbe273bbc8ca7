"""The paper's baseline with its obvious weaknesses repaired, still without looking at what comes after the next target.

As in the baseline carriers are assigned to targets, and rovers on the ground explore their areas by themselves, nearest
target first. What is repaired (docs/strategies.md tells why):

- a carrier's cost is when the target would be explored, whichever robot does it: detours, docking, undocking and the
  rover's drive count, and of several rovers and meeting points those are chosen that are soonest. A rover to be
  retrieved finishes its area first;
- a second rover is set down in an area if a target there would be explored `GAIN_MS` sooner than by those at work;
- rovers without work in an area explore targets that carriers were not sent to;
- a carrier keeps its target unless another assignment is better by more than a trifle;
- carriers without a target stand by (`marsupial.strategies.standby`), and rovers wait at the nearest meeting point, not
  where they were set down.

References
----------
Wurm et al. 2010, section IV-B.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from marsupial.model.plan import Plan
from marsupial.model.robots import Role
from marsupial.model.strategy import Briefing, Decision
from marsupial.planning.list_scheduling.costs import NEVER, Mask, Times
from marsupial.planning.list_scheduling.greedy import serve
from marsupial.strategies.outlook import Option, Outlook
from marsupial.strategies.rules import decide_by
from marsupial.strategies.standby import stand_by

GAIN_MS = 20_000
"""How much sooner a target must be explored for a further rover to be set down in an area."""

Errand = tuple[Option, int]
"""What a carrier does next, and the index of the target."""


class HeuristicPlus:
    """The baseline, improved."""

    name = "heuristic-plus"

    def decide(self, briefing: Briefing) -> Decision:
        """Return the plan that gives each carrier at most one target, and rovers on the ground all of their areas."""
        return decide_by(self.name, _explore, briefing)


def _explore(briefing: Briefing) -> tuple[Plan, frozenset[str]]:
    start = Outlook(briefing.situation, briefing.previous)
    carriers = [robot.name for robot in briefing.situation.of_role(Role.CARRIER)]
    errands: list[Errand] = []
    draft = _drafted(start, errands)
    while (errand := _next_errand(draft, carriers, errands)) is not None:
        errands.append(errand)
        draft = _drafted(start, errands)
    outlook = draft.outlook
    sent = {option.robot for option, _ in errands}
    _help_out(draft)
    if not outlook.plan.explored:
        return serve(briefing.situation)
    for rover in _on_ground(outlook):
        outlook.wait_at_meeting(rover)
    stand_by(outlook, [carrier for carrier in carriers if carrier not in sent])
    return outlook.plan, frozenset()


@dataclass(slots=True)
class _TripPlan:
    """The actions of some errands and of the rovers on the ground.

    `left` (targets,) says which targets no robot explores, `by_ms` (targets,) when a rover on the ground explores those
    of its area, `idle` names the rovers on the ground without work.
    """

    outlook: Outlook
    left: Mask
    by_ms: Times
    idle: list[str]


def _drafted(start: Outlook, errands: list[Errand]) -> _TripPlan:
    """Return the draft with these errands, in which rovers finish their areas before they are retrieved."""
    outlook = start.afresh()
    left = np.ones(len(outlook.targets), dtype=np.bool_)
    left[[target for _, target in errands]] = False
    for option, target in errands:
        if not option.retrieved:
            outlook.take(option, target)
    by_ms = _tours(outlook, left)
    idle = [rover for rover in _on_ground(outlook) if not outlook.has_work(rover)]
    for option, target in errands:
        if option.retrieved and _possible(outlook, option, target):
            outlook.take(option, target)
            idle = [rover for rover in idle if rover != option.explorer]
    return _TripPlan(outlook=outlook, left=left, by_ms=by_ms, idle=idle)


def _tours(outlook: Outlook, left: Mask) -> Times:
    """Let rovers on the ground explore what only rovers can; again and again the one that is soonest at a target.

    Targets are taken off `left`. Returns when each is explored, `NEVER` for those that are not.
    """
    types = outlook.situation.type_by_name
    mine = [all(types[kind].role is Role.ROVER for kind in t.explorers) for t in outlook.situation.targets]
    rovers = _on_ground(outlook)
    by_ms: Times = np.full(len(left), NEVER, dtype=np.int64)
    while rovers and len(left):
        arrive = np.where(left & mine, [outlook.alone_ms(rover) for rover in rovers], NEVER)
        row, target = divmod(int(arrive.argmin()), len(left))
        if arrive[row, target] >= NEVER:
            break
        by_ms[target], left[target] = arrive[row, target], False
        outlook.explore(rovers[row], target)
    return by_ms


def _next_errand(draft: _TripPlan, carriers: list[str], errands: list[Errand]) -> Errand | None:
    """Return the soonest of the best assignment of the carriers that have no errand yet, None if there is none."""
    taken = {name for option, _ in errands for name in (option.robot, option.explorer)}
    retrievable = {rover for rover in _on_ground(draft.outlook) if rover not in taken}
    options = [
        [
            option.only(draft.left | _much_sooner(draft, option))
            for option in draft.outlook.options(carrier, retrievable=retrievable)
        ]
        for carrier in carriers
        if carrier not in taken
    ]
    chosen = draft.outlook.assign(options)
    return chosen[0] if chosen else None


def _much_sooner(draft: _TripPlan, option: Option) -> Mask:
    """Return for which targets of rovers on the ground it pays to set down another one that is aboard."""
    spare = not option.retrieved and option.robot != option.explorer
    return np.asarray(spare & (draft.by_ms < NEVER) & (option.end_ms + GAIN_MS <= draft.by_ms))


def _help_out(draft: _TripPlan) -> None:
    outlook = draft.outlook
    for option, target in outlook.assign([[o.only(draft.left) for o in outlook.options(r)] for r in draft.idle]):
        outlook.take(option, target)
        draft.left[target] = False


def _possible(outlook: Outlook, option: Option, target: int) -> bool:
    options = outlook.options(option.robot, retrievable={option.explorer})
    return any(o.explorer == option.explorer and o.end_ms[target] < NEVER for o in options)


def _on_ground(outlook: Outlook) -> list[str]:
    rovers = outlook.situation.of_role(Role.ROVER)
    return [rover.name for rover in rovers if outlook.timeline.on[rover.name] is None]
