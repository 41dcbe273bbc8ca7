"""The cases that `marsupial compare` is asked for: scenarios, each with every team."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from marsupial.bench.compare.plan import Case, prepared
from marsupial.cli.display.messages import warn
from marsupial.cli.missions import warn_of
from marsupial.errors import UsageError
from marsupial.library.scenarios import load_scenario
from marsupial.model.robots import Role
from marsupial.model.scenario import MissionLimits, Scenario, has_fixed_starts

MOST_CASES = 10_000


def cases_of(
    sources: Sequence[str], carriers: Sequence[int] | None, rovers: Sequence[int] | None, limits: MissionLimits | None
) -> dict[Case, Scenario]:
    """Return the scenarios that these options name, by case; None takes the team or limits that a scenario has."""
    if len(sources) * len(carriers or (0,)) * len(rovers or (0,)) > MOST_CASES:
        raise UsageError(f"more than {MOST_CASES} combinations of scenarios and teams")
    found: dict[Case, Scenario] = {}
    for source in dict.fromkeys(sources):
        of_source = _of_source(source, carriers, rovers, limits)
        if not found.keys().isdisjoint(of_source):  # several files called map.yaml
            of_source = {replace(case, scenario=source): scenario for case, scenario in of_source.items()}
        found |= of_source
    return found


def _of_source(
    source: str, carriers: Sequence[int] | None, rovers: Sequence[int] | None, limits: MissionLimits | None
) -> dict[Case, Scenario]:
    found: dict[Case, Scenario] = {}
    grid = None
    for carrier_count in carriers or (None,):
        for rover_count in rovers or (None,):
            loaded = load_scenario(source, carrier_count, rover_count)
            if grid is None:
                warn_of(loaded)
                grid = loaded.scenario.grid  # one for all teams: it travels to each worker once
            scenario = prepared(replace(loaded.scenario, grid=grid))
            found[_case(scenario)] = scenario if limits is None else replace(scenario, limits=limits)
    if any(map(has_fixed_starts, found.values())):
        warn(f"{source}: all starts are fixed: every run of it is the same mission")
    return found


def _case(scenario: Scenario) -> Case:
    roles = [scenario.type_of(member).role for member in scenario.team]
    count = roles.count(Role.CARRIER)
    return Case(scenario.name, count, round(roles.count(Role.ROVER) / count))
