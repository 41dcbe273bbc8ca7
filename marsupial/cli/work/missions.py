"""The work of `marsupial run`: choose scenario, planner and budget, run the mission, show progress, write the log.

Arguments are checked before the slow imports.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from marsupial.cli.display.messages import Alive, say, warn
from marsupial.cli.process.interrupt import asked_to_stop
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.library.choices import DEFAULT_PLANNER, budget_of, planner_for, takes_budget
from marsupial.library.scenarios import LoadedScenario, load_scenario
from marsupial.model.planning import NO_PLANNER, Budget
from marsupial.model.robots import Routes
from marsupial.model.scenario import MissionLimits, PlanningTime, Scenario, has_fixed_starts, with_routes
from marsupial.planning.engines import mission_engine
from marsupial.strategies.files import StrategyFile, faults_of, strategy_file
from marsupial.strategies.registry import asks_planner, check_strategy
from marsupial.strategies.registry import strategy as made
from marsupial.wording import no_option

if TYPE_CHECKING:
    from marsupial.library.metrics import Summary
    from marsupial.mission.observer import Observer

DEFAULT_SEED = 1

PATIENCE_S = 60.0  # how long to retry a service that is busy or not reachable


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionRequest:
    """The arguments of a mission; None takes the default."""

    source: str
    strategy: str = "temporal"
    planner: str | None = None
    carriers: int | None = None
    rovers: int | None = None
    seed: int | None = None
    budget_s: float | None = None
    steps: int | None = None
    log: Path | None = None
    planning_time: str | None = None
    routes: str | None = None
    interference: bool = False
    time_limit_s: float | None = None
    server: str | None = None
    resolution_m: float | None = None


def carry_out(request: MissionRequest, *, again: bool = False) -> tuple[Summary, Scenario]:
    """Run the mission with progress on stderr, without warnings if run `again`; return its summary and scenario."""
    strategy = _strategy(request)
    budget = budget_of(request.budget_s, request.steps)
    _warn_of_ignored(request, strategy)
    planner = _planner(request, strategy, budget)  # before the map is read: a wrong name is reported at once
    with Alive(lambda: "reading the map ..."):
        loaded = load_scenario(request.source, request.carriers, request.rovers, request.resolution_m)
        warnings = [] if again else loaded.warnings()
    scenario = _asked_for(loaded.scenario, request)
    for text in warnings:
        warn(text)
    if request.seed is not None and (scenario.start_seed is not None or has_fixed_starts(scenario)):
        warn(f"--seed {request.seed} is ignored: {request.source} says where robots start")
    from marsupial.cli.display.progress import progress
    from marsupial.library.first_use import STAND_IN, prepare_mission
    from marsupial.library.missions import simulate
    from marsupial.library.recording import LogFile
    from marsupial.mission.observer import Observers

    # A service plans by itself: here only the simulated robots run, as under any strategy.
    here = request.server is None
    run: Callable[..., Summary] = simulate if request.server is None else _simulate_by(request.server)
    prepare_mission(scenario, strategy if here else STAND_IN, planner if here else NO_PLANNER, say)()
    with ExitStack() as stack:
        if isinstance(strategy, StrategyFile):
            stack.enter_context(faults_of(strategy.path))
        observers: list[Observer] = [stack.enter_context(progress())]
        if request.log is not None:
            observers.append(stack.enter_context(LogFile(request.log)))
        stopping = {} if request.server is not None else {"cancelled": stack.enter_context(asked_to_stop())}
        summary = run(
            scenario,
            strategy=strategy,
            planner=planner,
            budget=budget,
            seed=DEFAULT_SEED if request.seed is None else request.seed,
            observer=Observers(observers),
            **stopping,
        )
    return replace(summary, log=request.log), scenario


def warn_of(loaded: LoadedScenario) -> None:
    """Print the warnings about the map of a scenario, the same as `marsupial map` prints."""
    for text in loaded.warnings():
        warn(text)


def changed(
    scenario: Scenario, *, routes: str | None = None, interference: bool = False, limits: MissionLimits | None = None
) -> Scenario:
    """Return the scenario with ``--routes``, ``--interference`` and the limits; options not given change nothing."""
    if routes is not None:
        if routes not in list(Routes):
            raise UsageError(f"--routes: {no_option(routes, Routes)}")
        scenario = with_routes(scenario, Routes(routes))
    scenario = replace(scenario, interference=scenario.interference or interference)
    return scenario if limits is None else replace(scenario, limits=replace(scenario.limits, time_ms=limits.time_ms))


def limits_of(time_limit_s: float | None) -> MissionLimits | None:
    """Return the limits of ``--time-limit``, which must be positive and finite; None keeps the scenario's."""
    if time_limit_s is None:
        return None
    if not (time_limit_s > 0 and math.isfinite(time_limit_s)):
        raise UsageError(f"--time-limit: must be positive, got {time_limit_s:g}")
    return MissionLimits(time_ms=max(1, round(1000 * time_limit_s)))


def _strategy(request: MissionRequest) -> str | StrategyFile:
    found = strategy_file(request.strategy)
    if found is None:
        check_strategy(request.strategy)
        return request.strategy
    strategy, planner = found
    if planner is not None:
        raise UsageError(f"--strategy {request.strategy}: name its planner with --planner {planner}")
    if request.server is not None:
        raise UsageError(f"--server: a service does not run the strategies of your files, such as {strategy.name}")
    return strategy


def _warn_of_ignored(request: MissionRequest, strategy: str | StrategyFile) -> None:
    given: dict[str, object] = {"--budget": request.budget_s, "--steps": request.steps}
    ignored: dict[str, object] = {} if takes_budget(strategy) else given
    if not asks_planner(strategy):
        ignored = {"--planner": request.planner, **ignored}
    if said := [f"{option} {value}" for option, value in ignored.items() if value is not None]:
        are = "is" if len(said) == 1 else "are"
        warn(f"strategy {request.strategy} asks no planner: {' and '.join(said)} {are} ignored")


def _planner(request: MissionRequest, strategy: str | StrategyFile, budget: Budget) -> str:
    planner = str(planner_for(strategy, request.planner or DEFAULT_PLANNER))
    if planner != NO_PLANNER and request.server is None:
        mission_engine(planner, budget)  # raises early if it can't be used
    if isinstance(strategy, StrategyFile):
        made(strategy, planner=planner, budget=budget)  # so does this, for what a strategy of somebody else may lack
    return planner


def _simulate_by(server: str) -> Callable[..., Summary]:
    """Return a function that runs a mission planned by a service."""
    try:
        from marsupial_client import Busy, Client, ProxyUnusable
    except ImportError as error:
        raise EngineUnavailable(f"--server needs {error.name}: pip install 'marsupial[client]'") from error
    from marsupial_service.simulation import simulate_mission

    def report_outage(error: Exception) -> None:
        there = "" if isinstance(error, Busy) else ": is `marsupial serve` running there?"
        say(f"{error}; trying for {PATIENCE_S:g} s{there}")

    try:
        client = Client(server, key=os.environ.get("MARSUPIAL_KEY"), patience_s=PATIENCE_S, on_outage=report_outage)
    except (ValueError, ProxyUnusable) as error:
        raise UsageError(f"--server: {error}") from error
    return partial(simulate_mission, client, stopping=asked_to_stop)


def _asked_for(scenario: Scenario, request: MissionRequest) -> Scenario:
    if request.planning_time is not None:
        if request.planning_time not in list(PlanningTime):
            raise UsageError(f"--planning-time: {no_option(request.planning_time, PlanningTime)}")
        scenario = replace(scenario, planning_time=PlanningTime(request.planning_time))
    scenario = changed(scenario, routes=request.routes, interference=request.interference)
    if scenario.interference and request.server is not None:
        raise UsageError("--server: robots of a service share cells, so it takes no interference")
    return changed(scenario, limits=limits_of(request.time_limit_s))
