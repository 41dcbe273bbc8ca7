"""Checks of arguments that may be objects of the caller's own: strategies, planners, sensors."""

from collections.abc import Callable

from marsupial.model import Decider, Engine, EngineInfo
from marsupial.model.arguments import refuse, text, with_parts
from marsupial.model.mission import MissionEvent
from marsupial.model.strategy import checked_decider
from marsupial.planning.extensions import CheckedEngine
from marsupial.sim.sensors import Sensor


def strategy_argument(value: str | Decider) -> str | Decider:
    if isinstance(value, str):
        return text("strategy", value)
    return checked_decider("strategy", value)


def planner_argument(value: str | Engine) -> str | Engine:
    """Return an engine's name, checked, or an engine whose events are checked."""
    if isinstance(value, str):
        return text("planner", value)
    with_parts("planner", value, "info", "solve")
    if not isinstance(value.info, EngineInfo):
        refuse("planner: info", "an EngineInfo", value.info)
    text("planner: info.name", value.info.name)
    return CheckedEngine(value)


def sensor_argument(value: Sensor | None) -> Sensor | None:
    if value is not None:
        with_parts("sensor", value, "visible")
    return value


def progress_argument(value: Callable[[MissionEvent], object]) -> Callable[[MissionEvent], object]:
    if not callable(value):
        refuse("progress", "a function of one event", value)
    return value
