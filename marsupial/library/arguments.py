"""Checks of arguments that may be objects of the caller's own: strategies, planners, sensors."""

from collections.abc import Callable

from marsupial.errors import UsageError
from marsupial.model import Decider, Engine, EngineInfo
from marsupial.model.arguments import refuse, text
from marsupial.model.mission import MissionEvent
from marsupial.planning.extensions import CheckedEngine
from marsupial.sim.sensors import Sensor


def strategy_argument(value: str | Decider) -> str | Decider:
    if isinstance(value, str):
        return text("strategy", value)
    _check_parts("strategy", value, "name", "decide")
    text("strategy: name", value.name)
    return value


def planner_argument(value: str | Engine) -> str | Engine:
    """Return an engine's name, checked, or an engine whose events are checked."""
    if isinstance(value, str):
        return text("planner", value)
    _check_parts("planner", value, "info", "solve")
    if not isinstance(value.info, EngineInfo):
        refuse("planner: info", "an EngineInfo", value.info)
    text("planner: info.name", value.info.name)
    return CheckedEngine(value)


def sensor_argument(value: Sensor | None) -> Sensor | None:
    if value is not None:
        _check_parts("sensor", value, "visible")
    return value


def progress_argument(value: Callable[[MissionEvent], object]) -> Callable[[MissionEvent], object]:
    if not callable(value):
        refuse("progress", "a function of one event", value)
    return value


def _check_parts(name: str, value: object, *parts: str) -> None:
    """Check that an object has these attributes, the last one a method."""
    if isinstance(value, type):
        raise UsageError(f"{name}: must be an object, not the class {value.__name__}")
    if missing := [part for part in parts if not hasattr(value, part)]:
        raise UsageError(f"{name}: {type(value).__name__} has no {' and no '.join(missing)}")
    if not callable(getattr(value, parts[-1])):
        refuse(f"{name}: {parts[-1]}", "a method", getattr(value, parts[-1]))
