"""Temporal planning for marsupial robot teams that explore unknown maps.

::

    import marsupial

    result = marsupial.explore("office", seed=1)
    print(result.exploration_time_s, result.quality)
    result.plot().savefig("office.png")

``docs/library.md`` describes the API. Each name here is imported at its first use, so that `import marsupial` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from marsupial.bench.compare.calling import ComparisonResult, compare
    from marsupial.errors import MarsupialError
    from marsupial.library.exploring import Exploration, explore
    from marsupial.library.metrics import METRICS, Metric
    from marsupial.library.plans import Plans, check, plan
    from marsupial.library.scenarios import scenario
    from marsupial.library.situations import situation_files
    from marsupial.library.stepping import Mission, Observation
    from marsupial.library.up_registration import register_with_unified_planning
    from marsupial.model import Action, ActionName, Cell, Grid, Plan, RobotType, Scenario, Situation, StrategyInfo
    from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Improved, Outcome
    from marsupial.model.strategy import Briefing, Decision, PlanningReport, Strategy
    from marsupial.sim.sensors import FieldOfView, Sensor

__all__ = [
    "METRICS", "Action", "ActionName", "Briefing", "Budget", "Cell", "ComparisonResult", "Decision", "Engine",
    "EngineInfo", "Exploration", "FieldOfView", "Finished", "Grid", "Improved", "MarsupialError", "Metric", "Mission",
    "Observation", "Outcome", "Plan", "PlanningReport", "Plans", "RobotType", "Scenario", "Sensor", "Situation",
    "Strategy", "StrategyInfo", "__version__", "check", "compare", "explore", "plan", "register_with_unified_planning",
    "scenario", "situation_files",
]  # fmt: skip

_HOMES = {
    "bench.compare.calling": ("ComparisonResult", "compare"),
    "errors": ("MarsupialError",),
    "library.exploring": ("Exploration", "explore"),
    "library.metrics": ("METRICS", "Metric"),
    "library.plans": ("Plans", "check", "plan"),
    "library.scenarios": ("scenario",),
    "library.situations": ("situation_files",),
    "library.stepping": ("Mission", "Observation"),
    "library.up_registration": ("register_with_unified_planning",),
    "sim.sensors": ("FieldOfView", "Sensor"),
}
"""The modules of names that are not from `marsupial.model`; `__getattr__` imports them at the first use (PEP 562)."""


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = next((module for module, names in _HOMES.items() if name in names), "model")
    value = globals()[name] = getattr(import_module(f"{__name__}.{home}"), name)
    return value


def __dir__() -> list[str]:
    return list(__all__)
