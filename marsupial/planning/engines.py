"""The engines, by the name the command line and comparisons use.

Listing them imports neither numba nor scipy: the code of an engine is imported when it is first asked for a plan.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pkgutil import resolve_name

from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model import MAKESPAN, Budget, Engine, EngineInfo, Finished, Improved, Objective, Plan, Situation
from marsupial.planning import infos
from marsupial.planning.batteries.engine import BatteryEngine
from marsupial.planning.extensions import extension_engine, extension_infos
from marsupial.planning.external import commands
from marsupial.planning.external.aries import aries, load_aries
from marsupial.planning.external.commands import PREFIX, External
from marsupial.planning.external.decompose import PartSize
from marsupial.planning.external.decomposed import Decomposed
from marsupial.planning.external.tamer import load_tamer, tamer
from marsupial.planning.names import OWN, engine_names
from marsupial.planning.race import punctual
from marsupial.wording import unknown_name


class DeferredEngine:
    """An engine whose code (``package.module:name``) is imported when it is first asked for a plan."""

    def __init__(self, info: EngineInfo, target: str) -> None:
        self.info = info
        self._target = target

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        engine: Engine = resolve_name(self._target)()
        return engine.solve(situation, budget, objective=objective, start=start)


ENGINES: Mapping[str, Callable[[], Engine]] = {
    "anytime": partial(DeferredEngine, infos.ANYTIME, "marsupial.planning.local_search.engine:Anytime"),
    "aries": aries,
    "auto": partial(DeferredEngine, infos.AUTO, "marsupial.planning.auto:auto"),
    "exact": partial(DeferredEngine, infos.EXACT, "marsupial.planning.branch_and_bound.engine:Exact"),
    "greedy": partial(DeferredEngine, infos.GREEDY, "marsupial.planning.greedy:Greedy"),
    "tamer": tamer,
}

PROCESSES = frozenset({"aries", "tamer"})  # engines that run in processes of their own, as external planners do

PRELOAD = (load_tamer, load_aries, commands)  # load the libraries of engines in processes of their own

# sizes of the parts that an engine plans within some seconds; engines not listed here accept any size
PART_SIZES: Mapping[str, tuple[PartSize, ...]] = {
    "aries": (
        PartSize(rovers=3, targets=4, seconds=3.0),
        PartSize(rovers=2, targets=3, seconds=1.5),
        PartSize(rovers=2, targets=2, seconds=0.8),
        PartSize(rovers=2, targets=2, choices=1, seconds=0.5),
    ),
    "tamer": (
        PartSize(rovers=3, targets=4, seconds=2.0),
        PartSize(rovers=2, targets=3, seconds=0.7),
        PartSize(rovers=2, targets=2, choices=1, seconds=0.4),
    ),
}


def engine(name: str) -> BatteryEngine | External:
    """Return the engine of a name or command line (`PREFIX`), perhaps missing here; UsageError if unknown."""
    found = _named(name)
    return found if isinstance(found, External) and found.knows_batteries else BatteryEngine(found)


def _named(name: str) -> Engine:
    if name.startswith(PREFIX):
        return External(name)
    if name in ENGINES:
        return ENGINES[name]()
    found = extension_engine(name, ENGINES)
    if found is None:
        known = unknown_name("planner", name, engine_names())
        raise UsageError(f"{known}, and '{PREFIX}<command> {{domain}} {{problem}}'")
    return punctual(found)


def engine_of(planner: str | Engine) -> Engine:
    """Return the engine of a name, or the given one, cut off when its budget is up."""
    return engine(planner) if isinstance(planner, str) else BatteryEngine(punctual(planner))


def mission_engine(planner: str | Engine, budget: Budget) -> Engine:
    """Return the engine for missions: it supports budgets of that kind, and splits situations that are too big for it.

    Raise `UsageError` if the name is unknown, or the engine does not support such a budget; `EngineUnavailable` if it
    is not installed here.
    """
    found = engine_of(planner)
    name = found.info.name
    if found.info.missing is not None:
        raise EngineUnavailable(f"planner {name}: {found.info.missing}")
    if budget.steps is not None and not found.info.deterministic_steps:
        raise UsageError(f"planner {name} can't count steps: give it a budget in seconds")
    return Decomposed(found, *PART_SIZES[name]) if name in PART_SIZES else found


def engine_infos() -> tuple[EngineInfo, ...]:
    """Return the description of every engine: ours first, then those of installed packages, usable or not."""
    return (*(ENGINES[name]().info for name in OWN), *extension_infos(ENGINES))
