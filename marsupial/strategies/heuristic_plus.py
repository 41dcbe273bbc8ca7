"""The paper's baseline without its obvious weaknesses; like the baseline, it looks one target ahead.

Carriers are assigned to targets, and rovers on the ground explore their areas, nearest target first. Different from
the baseline (docs/strategies.md says why):

- A carrier's cost is the time at which the target would be explored by any robot. So the cost includes detours,
  docking, undocking and the rover's drive, minimised over rovers and meeting points. A rover to be retrieved finishes
  its area first.
- A second rover is set down in an area if a target there would be explored `GAIN_MS` sooner than by those at work.
- Rovers without work in their area explore targets that no carrier was sent to.
- A carrier keeps its target unless another assignment is clearly better.
- Carriers without a target stand by (`Outlook.stand_by`), and rovers wait at the nearest meeting point, not where they
  were set down.

References
----------
Wurm et al. 2010, section IV-B.
"""

from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import Briefing, Plan, Role
from marsupial.model.grid import Mask
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.costs import NEVER
from marsupial.strategies.outlook import Option, Outlook
from marsupial.strategies.rules import RuleStrategy

GAIN_MS = 20_000  # a further rover is set down in an area if it explores a target there at least this much sooner
CarrierJob = tuple[Option, int]  # a carrier's next option, and the index of its target


class HeuristicPlus(RuleStrategy):
    """The baseline, improved."""

    name = "heuristic-plus"

    def explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str]]:
        start = Outlook(briefing.situation, briefing.previous)
        carriers = [robot.name for robot in briefing.situation.of_role(Role.CARRIER)]
        jobs: list[CarrierJob] = []
        draft = _drafted(start, jobs)
        # fix one job at a time and redraft, as each job changes the options of rovers on the ground
        while (job := _next_job(draft, carriers, jobs)) is not None:
            jobs.append(job)
            draft = _drafted(start, jobs)
        outlook = draft.outlook
        sent = {option.robot for option, _ in jobs}
        for option, target in outlook.assign([[o.only(draft.left) for o in outlook.options(r)] for r in draft.idle]):
            outlook.take(option, target)
            draft.left[target] = False
        if not outlook.plan.explored:
            return serve(briefing.situation)
        for rover in _on_ground(outlook):
            outlook.wait_at_meeting(rover)
        outlook.stand_by([carrier for carrier in carriers if carrier not in sent])
        return outlook.plan, frozenset()


@dataclass(slots=True)
class _TripPlan:
    """The actions of carriers' jobs and of the rovers on the ground."""

    outlook: Outlook
    left: Mask  # mask (targets,) of the targets that no robot explores
    by_ms: Ints  # times (targets,) at which rovers on the ground explore the targets of their areas
    idle: list[str]  # rovers on the ground without work


def _drafted(start: Outlook, jobs: list[CarrierJob]) -> _TripPlan:
    """Return the draft with these jobs; rovers finish their areas before they are retrieved."""
    outlook = start.emptied()
    left = np.ones(len(outlook.targets), dtype=np.bool_)
    left[[target for _, target in jobs]] = False
    for option, target in jobs:
        if not option.retrieved:
            outlook.take(option, target)
    # rovers on the ground explore before the jobs that retrieve them are added
    by_ms = _tours(outlook, left)
    busy = {robot for action in outlook.timeline.actions for robot in action.robots}
    idle = [rover for rover in _on_ground(outlook) if rover not in busy]
    for option, target in jobs:
        now = outlook.options(option.robot, retrievable={option.explorer}) if option.retrieved else []
        if any(o.explorer == option.explorer and o.end_ms[target] < NEVER for o in now):
            outlook.take(option, target)
            idle = [rover for rover in idle if rover != option.explorer]
    return _TripPlan(outlook=outlook, left=left, by_ms=by_ms, idle=idle)


def _tours(outlook: Outlook, left: Mask) -> Ints:
    """Assign rover-only targets to rovers on the ground: repeatedly the pair with the earliest arrival.

    Remove them from `left`; return when each is explored, `NEVER` for the others.
    """
    types = outlook.situation.type_by_name
    mine = [all(types[kind].role is Role.ROVER for kind in t.explorers) for t in outlook.situation.targets]
    rovers = _on_ground(outlook)
    by_ms: Ints = np.full(len(left), NEVER, dtype=np.int64)
    while rovers and len(left):
        arrive = np.where(left & mine, [outlook.alone_ms(rover) for rover in rovers], NEVER)
        row, target = divmod(int(arrive.argmin()), len(left))
        if arrive[row, target] >= NEVER:
            break
        by_ms[target], left[target] = arrive[row, target], False
        outlook.explore(rovers[row], target)
    return by_ms


def _next_job(draft: _TripPlan, carriers: list[str], jobs: list[CarrierJob]) -> CarrierJob | None:
    """Return the earliest job of the best assignment of carriers without a job, or None."""
    taken = {name for option, _ in jobs for name in (option.robot, option.explorer)}
    retrievable = {rover for rover in _on_ground(draft.outlook) if rover not in taken}
    free = [carrier for carrier in carriers if carrier not in taken]
    options = [draft.outlook.options(carrier, retrievable=retrievable) for carrier in free]
    chosen = draft.outlook.assign([[o.only(draft.left | _much_sooner(draft, o)) for o in mine] for mine in options])
    return chosen[0] if chosen else None


def _much_sooner(draft: _TripPlan, option: Option) -> Mask:
    """Return the targets of rovers on the ground that justify setting down a further rover."""
    spare = not option.retrieved and option.robot != option.explorer
    return np.asarray(spare & (draft.by_ms < NEVER) & (option.end_ms + GAIN_MS <= draft.by_ms))


def _on_ground(outlook: Outlook) -> list[str]:
    rovers = outlook.situation.of_role(Role.ROVER)
    return [rover.name for rover in rovers if outlook.timeline.on[rover.name] is None]
