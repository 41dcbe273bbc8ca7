"""The values that pass between all parts: maps, robots, situations, plans, missions.

All are frozen dataclasses, enums or protocols, and know nothing of files, planners or the simulator.
``from marsupial.model import Situation, Plan`` imports only the modules that define these names, at that moment:
listing strategies or planners must not wait for numpy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from marsupial.model.frames import FrameShift
    from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Cell, CellArray, Grid, Mask, Terrain
    from marsupial.model.mapreading import LegendEntry, MapReading
    from marsupial.model.mission import (
        ActionEnd,
        ActionEnded,
        ActionStarted,
        Cause,
        Changed,
        DriveEnded,
        DriveStarted,
        FrameGrown,
        MapMeeting,
        MapTarget,
        MissionEnded,
        MissionEvent,
        MissionStarted,
        PlacedRobot,
        Planned,
        Remaining,
        Revealed,
        RobotLost,
        Status,
        Trigger,
        Triggers,
    )  # fmt: skip
    from marsupial.model.objective import MAKESPAN, Makespan, Objective, ObjectiveName, PricedArrival, Value
    from marsupial.model.plan import EPSILON_MS, Action, ActionName, Plan
    from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Improved, Outcome
    from marsupial.model.robots import SQRT2, EnergyModel, RobotType, Role, Routes, TeamMember
    from marsupial.model.scenario import Goal, MissionLimits, PlanningTime, Scenario
    from marsupial.model.situation import (
        UNREACHABLE,
        PlanningType,
        RobotState,
        Situation,
        SituationGoal,
        TargetInfo,
        TravelTable,
    )  # fmt: skip
    from marsupial.model.strategy import Briefing, Decider, Decision, PlanningReport, PlanProgress, Strategy
    from marsupial.model.strategyinfo import StrategyInfo
    from marsupial.model.team import Deployments, Whereabouts
    from marsupial.model.unseen import Square, Unseen
    from marsupial.model.world import Manoeuvres, News, RobotReport, World

__all__ = [
    "EPSILON_MS", "FLOOR", "MAKESPAN", "OBSTACLE", "ROUGH", "SQRT2", "TERRAINS", "UNKNOWN", "UNREACHABLE",
    "Action", "ActionEnd", "ActionEnded", "ActionName", "ActionStarted", "Briefing", "Budget", "Cause", "Cell",
    "CellArray", "Changed", "Decider", "Decision", "Deployments", "DriveEnded", "DriveStarted", "EnergyModel",
    "Engine", "EngineInfo", "Finished", "FrameGrown", "FrameShift", "Goal", "Grid", "Improved", "LegendEntry",
    "Makespan", "Manoeuvres", "MapMeeting", "MapReading", "MapTarget", "Mask", "MissionEnded", "MissionEvent",
    "MissionLimits", "MissionStarted", "News", "Objective", "ObjectiveName", "Outcome", "PlacedRobot", "Plan",
    "PlanProgress", "Planned", "PlanningReport", "PlanningTime", "PlanningType", "PricedArrival", "Remaining",
    "Revealed", "RobotLost", "RobotReport", "RobotState", "RobotType", "Role", "Routes", "Scenario", "Situation",
    "SituationGoal", "Square", "Status", "Strategy", "StrategyInfo", "TargetInfo", "TeamMember", "Terrain",
    "TravelTable", "Trigger", "Triggers", "Unseen", "Value", "Whereabouts", "World",
]  # fmt: skip

_NAMES = {
    "frames": "FrameShift",
    "grid": "FLOOR OBSTACLE ROUGH TERRAINS UNKNOWN Cell CellArray Grid Mask Terrain",
    "mapreading": "LegendEntry MapReading",
    "mission": "ActionEnd ActionEnded ActionStarted Cause Changed DriveEnded DriveStarted FrameGrown MapMeeting "
    "MapTarget MissionEnded MissionEvent MissionStarted PlacedRobot Planned Remaining Revealed RobotLost Status "
    "Trigger Triggers",
    "objective": "MAKESPAN Makespan Objective ObjectiveName PricedArrival Value",
    "plan": "EPSILON_MS Action ActionName Plan",
    "planning": "Budget Engine EngineInfo Finished Improved Outcome",
    "robots": "SQRT2 EnergyModel RobotType Role Routes TeamMember",
    "scenario": "Goal MissionLimits PlanningTime Scenario",
    "situation": "UNREACHABLE PlanningType RobotState Situation SituationGoal TargetInfo TravelTable",
    "strategy": "Briefing Decider Decision PlanningReport PlanProgress Strategy",
    "strategyinfo": "StrategyInfo",
    "team": "Deployments Whereabouts",
    "unseen": "Square Unseen",
    "world": "Manoeuvres News RobotReport World",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}
"""The module that defines each name."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    return value
