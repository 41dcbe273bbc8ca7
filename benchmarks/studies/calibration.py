"""How soon plans of `temporal` say that targets will be explored, and how soon they are.

Each plan promises a time for each of its targets. A target is explored when a later plan no longer has it: robots have
seen the unknown behind its frontier, or enough of it to move the frontier. The bias is the time until then minus the
promised one; below 0, targets are explored sooner than promised. Targets are grouped by who explores them, and by
whether the robot explores them next. Means and intervals are over the maps, which are those for tuning.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

from marsupial.bench.compare.statistics import Origin, estimate
from marsupial.bench.compare.tables import mean_text
from marsupial.bench.suite.maps import PLANNER, TUNING
from marsupial.library.missions import simulate
from marsupial.library.scenarios import load_scenario
from marsupial.mission.observer import Observer
from marsupial.model import Action, ActionName, Budget, MissionEvent, Role
from marsupial.model.mission import MissionEnded, Planned

TEAMS = ((2, 2), (4, 2))

Group = tuple[str, str]
"""Who explores a target, and whether it is the robot's next one."""

Promise = tuple[Group, float, float]
"""A group, the seconds from the plan until a target should be explored, and until it is."""


class Promises(Observer):
    """Collects the plans of a mission."""

    def __init__(self, plans: Sequence[Planned] = (), explored_ms: int | None = None) -> None:
        self._plans = [*plans]
        self._explored_ms = explored_ms

    def event(self, event: MissionEvent) -> None:
        if isinstance(event, Planned):
            self._plans.append(event)
        elif isinstance(event, MissionEnded):
            self._explored_ms = event.exploration_ms

    def of(self, carriers: frozenset[str]) -> Iterator[Promise]:
        """Yield the promises of all plans; none if the mission left something unexplored."""
        if self._explored_ms is None:
            return
        # from the last plan backwards: when each target of the next plan is gone
        gone_ms: dict[str, int] = {}
        next_ms = self._explored_ms
        for plan in reversed(self._plans):
            gone_ms = {target.name: gone_ms.get(target.name, next_ms) for target in plan.targets}
            next_ms = plan.t_ms
            for group, action in _explorations(plan.actions, carriers):
                if action.place in gone_ms:
                    promised_ms = action.start_ms + action.duration_ms - plan.t_ms
                    yield group, promised_ms / 1000, (gone_ms[action.place] - plan.t_ms) / 1000


def _explorations(actions: Sequence[Action], carriers: frozenset[str]) -> Iterator[tuple[Group, Action]]:
    """Yield the explorations of a plan with their groups."""
    set_down: set[str] = set()
    busy: set[str] = set()
    for action in actions:
        if action.name is ActionName.UNDOCK:
            set_down.add(action.robot)
        elif action.name is ActionName.EXPLORE:
            rover = "rover set down first" if action.robot in set_down else "rover on the ground"
            who = "carrier" if action.robot in carriers else rover
            yield (who, "later" if action.robot in busy else "next"), action
            busy.add(action.robot)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks calibration", description=__doc__)
    parser.add_argument("--suite", choices=sorted(TUNING), default="footprint", help="default: %(default)s")
    parser.add_argument("--maps", type=int, help="the first maps of the suite (default: all)")
    chosen = parser.parse_args(arguments)
    suite = TUNING[chosen.suite]
    found: dict[Group, list[tuple[Origin, float, float]]] = {}
    for source in suite.sources()[: chosen.maps]:
        for carriers, rovers in TEAMS:
            scenario, promises = load_scenario(source, carriers, rovers).scenario, Promises()
            simulate(
                scenario,
                strategy="temporal",
                planner=PLANNER,
                budget=Budget(steps=8),
                seed=suite.first_seed,
                observer=promises,
            )
            of_carriers = frozenset(m.name for m in scenario.team if scenario.type_of(m).role is Role.CARRIER)
            for group, promised_s, explored_s in promises.of(of_carriers):
                found.setdefault(group, []).append((Origin(scenario.name, suite.first_seed), promised_s, explored_s))
    print("explored by             that is  promises  promised, s  explored, s        bias, s")
    for (who, when), rows in sorted(found.items()):
        origins = [origin for origin, _, _ in rows]
        columns = zip(
            *((promised_s, explored_s, explored_s - promised_s) for _, promised_s, explored_s in rows), strict=True
        )
        means = [mean_text(estimate(origins, values), 1, len(rows)) for values in columns]
        print(f"{who:23} {when:7} {len(rows):9}  {means[0]:>11}  {means[1]:>11}  {means[2]:>13}")
    return 0
