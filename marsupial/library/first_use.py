"""Load or compile what planners and missions need before any budget counts.

The first call of a planner in a process loads compiled code, or compiles it where the machine has none (half a minute
for a mission). Both would be charged to the first planning, whose budget may be a second. So a caller prepares first:

::

    caller                        thread                                   process that starts planners
    prepare_mission(...) ───────► try_mission: explore a tiny map ───┐     import their libraries
      reads the scenario,         try_planner: plan for a tiny team  │                 │
      opens its log                 │ compiles? say it every 5 s     │                 │
    wait() ◄────────────────────────┴────────────────────────────────┴─────────────────┘
    simulate(...)                 its budget is spent on planning alone

There is no list of functions to load: the trials call what the mission will call, for the types of arguments that it
will have, as numba compiles a function for each signature. What a trial raises is dropped, since the real call raises
it again where it can be reported. A strategy or planner of another package may have side effects, so it is never
tried; one of ours stands in for it.

Where code is stored and how it is shipped: `marsupial.codecache`; what is compiled for the package:
`marsupial.library.precompiling`. What compiling costs, and how that was brought down: docs/benchmarks.md.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from importlib.resources import files
from threading import Thread

from marsupial import native
from marsupial.codecache import is_lasting
from marsupial.formats.situation import situation_from_json
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.choices import AnyStrategy
from marsupial.library.missions import simulate
from marsupial.model import Budget, Engine, ObjectiveName, Role, Scenario, Situation
from marsupial.model.planning import NO_PLANNER
from marsupial.planning.engines import PRELOAD, PROCESSES, engine
from marsupial.planning.external.commands import PREFIX
from marsupial.processes.launcher import warm_up
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import STRATEGIES

# The planner that missions fall back on where another one has no plan, and that gives others their first plan.
FALLBACK = "greedy"

STAND_IN = "heuristic"  # the strategy that is tried in place of another package's

SMALL_MAP = "lobby"

ONE_STEP = Budget(steps=1)

SAY_EVERY_S = 5.0

Say = Callable[[str], None]


def prepare_planner(planner: str, say: Say = lambda text: None) -> Callable[[], None]:
    """Start to load or compile a planner; return a function that waits for it. `say` gets the progress of compiling."""
    processes = _has_processes(planner)
    return _begin((lambda: try_planner(FALLBACK if processes else planner),), say, processes=processes)


def prepare_mission(
    scenario: Scenario, strategy: AnyStrategy, planner: str | Engine, say: Say = lambda text: None
) -> Callable[[], None]:
    """Start to load or compile what a mission needs, reporting to `say`; return a function that waits for it."""
    is_ours = isinstance(strategy, str) and (strategy == CLAIRVOYANT or strategy.split("/")[0] in STRATEGIES)
    tried = strategy if isinstance(strategy, str) and is_ours else STAND_IN
    rovers = any(scenario.type_of(member).role is Role.ROVER for member in scenario.team)
    processes = isinstance(planner, str) and _has_processes(planner)
    if not isinstance(planner, str) or planner == NO_PLANNER or processes:
        return _begin((lambda: try_mission(tried, FALLBACK, rovers),), say, processes=processes)
    trials = [lambda: try_mission(tried, planner, rovers)]
    # The tiny map asks such a planner for so little that most of its code is not called.
    if ObjectiveName.PRICED_ARRIVAL not in engine(planner).info.objectives:
        trials.append(lambda: try_planner(planner))
    return _begin(trials, say)


def _has_processes(planner: str) -> bool:
    return planner in PROCESSES or planner.startswith(PREFIX)


def _begin(trials: Sequence[Callable[[], object]], say: Say, *, processes: bool = False) -> Callable[[], None]:
    """Run trials in a thread; return a function that waits for it, and for the processes."""

    def run() -> None:
        with native.watched(_CompileProgress(say)):
            for trial in trials:
                with suppress(Exception):  # the real call raises it again, where it can be reported
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


class _CompileProgress:
    """Reports that functions are being compiled, and every few seconds how many are done."""

    def __init__(self, say: Say) -> None:
        self._say = say
        self._last_s: float | None = None

    def __call__(self, name: str, done: int, most: int) -> None:
        now = time.monotonic()
        if self._last_s is None:
            self._say("compiling, which is done once on a machine ..." if is_lasting() else "compiling ...")
        elif now - self._last_s < SAY_EVERY_S:
            return
        else:
            self._say(f"compiling: {done} functions done, of {most} at most; now {name}")
        self._last_s = now


@cache
def try_planner(planner: str) -> None:
    """Run one step of a planner on a tiny situation."""
    for _ in engine(planner).solve(trial_situation(), ONE_STEP):
        pass


@cache
def try_mission(strategy: str, planner: str, rovers: bool) -> None:
    """Explore a small map with one carrier, with or without a rover, by one of our strategies and planners."""
    scenario = builtin_scenario(SMALL_MAP, carriers=1, rovers=int(rovers))
    simulate(scenario, strategy=strategy, planner=planner, budget=ONE_STEP, seed=1)


def trial_situation() -> Situation:
    """Return a situation with all kinds of actions: undock, explore, dock, drive home."""
    # It is about the smallest whose optimal plan takes a search to prove: a smaller one would end before the search's
    # code is called.
    return situation_from_json((files("marsupial.library") / "trial.json").read_text(encoding="utf-8"))
