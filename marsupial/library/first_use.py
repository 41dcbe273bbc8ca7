"""What planners and missions cost once per process is paid before any budget counts.

Compiled code is loaded, or compiled where this machine has never run it, by planning for a tiny team, or by exploring a
tiny map; the process that starts other planners imports their libraries. All that goes on in the background until the
caller waits for it. What compiling costs, and how that was brought down: docs/benchmarks.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from threading import Thread

import numpy as np

from marsupial import native
from marsupial.arrays import Ints
from marsupial.generators.builtin import builtin_scenario
from marsupial.keeping import is_lasting
from marsupial.library.missions import simulate
from marsupial.model.objective import ObjectiveName
from marsupial.model.planning import NO_PLANNER, Budget, Engine
from marsupial.model.robots import Role
from marsupial.model.scenario import Scenario
from marsupial.model.situation import PlanningType, RobotState, Situation, SituationGoal, TargetInfo
from marsupial.model.strategy import Decider
from marsupial.planning.engines import PRELOAD, PROCESSES, engine
from marsupial.planning.external.commands import PREFIX
from marsupial.processes.launcher import warm_up
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import STRATEGIES

FALLBACK = "greedy"
"""What missions continue with where another planner has no plan, and what the others begin with."""

STAND_IN = "heuristic"
"""The strategy that is tried out for those that others bring along."""

SMALL_MAP = "lobby"

CARRIERS, TARGETS, MEETINGS = 2, 4, 3
"""In the situation that planners are tried out on; each carrier has a rover aboard."""

ONE_STEP = Budget(steps=1)

SAY_EVERY_S = 5.0

Say = Callable[[str], None]


def prepare_planner(planner: str, say: Say = lambda text: None) -> Callable[[], None]:
    """Begin to get a planner ready and return what waits until it is; `say` is told of what is compiled."""
    if _has_processes(planner):
        return _begin((lambda: try_planner(FALLBACK),), say, processes=True)
    return _begin((lambda: try_planner(planner),), say)


def prepare_mission(
    scenario: Scenario, strategy: str | Decider, planner: str | Engine, say: Say = lambda text: None
) -> Callable[[], None]:
    """Begin to get ready what a mission needs and return what waits until it is; `say` is told of what is compiled."""
    tried = strategy if isinstance(strategy, str) and _is_ours(strategy) else STAND_IN
    rovers = any(scenario.type_of(member).role is Role.ROVER for member in scenario.team)
    if not isinstance(planner, str) or planner == NO_PLANNER:
        return _begin((lambda: try_mission(tried, FALLBACK, rovers),), say)
    if _has_processes(planner):
        return _begin((lambda: try_mission(tried, FALLBACK, rovers),), say, processes=True)
    trials = [lambda: try_mission(tried, planner, rovers)]
    if ObjectiveName.PRICED_ARRIVAL not in engine(planner).info.objectives:  # it has the tiny map done with at once
        trials.append(lambda: try_planner(planner))
    return _begin(trials, say)


def _is_ours(strategy: str) -> bool:
    return strategy == CLAIRVOYANT or strategy.split("/")[0] in STRATEGIES


def _has_processes(planner: str) -> bool:
    return planner in PROCESSES or planner.startswith(PREFIX)


def _begin(trials: Sequence[Callable[[], object]], say: Say, *, processes: bool = False) -> Callable[[], None]:
    """Begin to try out in a thread, and return what waits for it and for the processes."""

    def run() -> None:
        with native.watched(_Told(say)):
            for trial in trials:
                with suppress(Exception):  # the call that needs it reports it
                    trial()

    if processes:
        warm_up(wait=False, preload=PRELOAD)
    thread = Thread(target=run, daemon=True)
    thread.start()

    def wait() -> None:
        if processes:
            warm_up()
        thread.join()

    return wait


class _Told:
    """Says that there is compiling, and how far it is every few seconds."""

    def __init__(self, say: Say) -> None:
        self._say = say
        self._said_s: float | None = None

    def __call__(self, name: str, done: int, most: int) -> None:
        now = time.monotonic()
        if self._said_s is None:
            self._say("compiling, which is done once on a machine ..." if is_lasting() else "compiling ...")
        elif now - self._said_s < SAY_EVERY_S:
            return
        else:
            self._say(f"compiling: {done} functions done, of {most} at most; now {name}")
        self._said_s = now


@cache
def try_planner(planner: str) -> None:
    """Have a planner take one step for a tiny team."""
    for _ in engine(planner).solve(trial_situation(), ONE_STEP):
        pass


@cache
def try_mission(strategy: str, planner: str, rovers: bool) -> None:
    """Let a carrier, with or without a rover, explore a small map by one of our strategies and planners."""
    simulate(
        builtin_scenario(SMALL_MAP, carriers=1, rovers=int(rovers)),
        strategy=strategy,
        planner=planner,
        budget=ONE_STEP,
        seed=1,
    )


def trial_situation() -> Situation:
    """Return one that needs a bit of everything: setting down, exploring, picking up, driving home.

    It is about the smallest whose shortest plan is proven to be that by a search only.
    """
    carriers, rovers = _named("carrier", CARRIERS), _named("rover", CARRIERS)
    starts, homes = _named("start", CARRIERS), _named("home", CARRIERS)
    targets, meetings = _named("target", TARGETS), _named("meeting", MEETINGS)
    times = _travel_ms(2 * CARRIERS + TARGETS + MEETINGS)
    return Situation(
        types=(
            PlanningType(name="carrier", role=Role.CARRIER, capacity=1),
            PlanningType(name="rover", role=Role.ROVER, dock_ms=1000, undock_ms=1000),
        ),
        robots=(
            *(
                RobotState(name=name, type="carrier", place=start, home=home)
                for name, start, home in zip(carriers, starts, homes, strict=True)
            ),
            *(
                RobotState(name=name, type="rover", carrier=carrier)
                for name, carrier in zip(rovers, carriers, strict=True)
            ),
        ),
        targets=tuple(TargetInfo(name=name, explorers=frozenset({"rover"})) for name in targets),
        meetings=meetings,
        homes=homes,
        travel_ms={"carrier": times, "rover": times},
        goal=SituationGoal(recover_rovers=True, return_home=True),
    )


def _named(what: str, count: int) -> tuple[str, ...]:
    return tuple(f"{what}{number}" for number in range(1, count + 1))


def _travel_ms(places: int) -> Ints:
    """Return (places, places): times drawn at random, each the shortest by way of other places."""
    drawn = np.random.default_rng(2).integers(1, 9, (places, places)) * 1000
    times = np.minimum(drawn, drawn.T)
    np.fill_diagonal(times, 0)
    for via in range(places):
        times = np.minimum(times, times[:, [via]] + times[[via]])
    return times
