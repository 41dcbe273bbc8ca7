"""The values that pass between all parts: maps, robots, situations, plans, missions.

All are frozen dataclasses, enums or protocols, independent of files, planners and the simulator. An import such as
``from marsupial.model import Plan`` loads only the modules that define these names: listing strategies or planners must
not wait for numpy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # type checkers do not see what `__getattr__` finds
    from marsupial.model.faults import *
    from marsupial.model.frames import *
    from marsupial.model.grid import *
    from marsupial.model.mission import *
    from marsupial.model.objective import *
    from marsupial.model.plan import *
    from marsupial.model.planning import *
    from marsupial.model.robots import *
    from marsupial.model.scenario import *
    from marsupial.model.situation import *
    from marsupial.model.strategy import *
    from marsupial.model.strategyinfo import *
    from marsupial.model.team import *
    from marsupial.model.world import *
    from marsupial.model.zones import *

_NAMES = {
    "frames": "FrameShift",
    "grid": "FLOOR OBSTACLE ROUGH TERRAINS UNKNOWN Cell CellArray Grid LegendEntry MapReading Mask Terrain",
    "mission": "ActionEnd ActionEnded ActionStarted Cause Changed DriveEnded DriveStarted FrameGrown GuessedGround "
    "Interference MapMeeting MapTarget MissionEnded MissionEvent MissionStarted PlacedRobot Planned Remaining Revealed "
    "RobotLost RobotReturned SpeedChanged Status Trigger Triggers ZoneChanged",
    "faults": "Fault FaultKind",
    "objective": "MAKESPAN Makespan Objective ObjectiveName PricedArrival Value",
    "plan": "EPSILON_MS Action ActionName Plan",
    "planning": "Budget Engine EngineInfo Finished Improved Outcome",
    "robots": "SQRT2 Battery EnergyModel RobotType Role Routes TeamMember",
    "scenario": "Goal MissionLimits PlanningTime Scenario",
    "situation": "UNREACHABLE PlanningBattery PlanningType RobotState Situation SituationGoal TargetInfo TravelTable",
    "strategy": "Briefing Decider Decision PlanningReport PlanProgress Reasons Square Strategy Unseen",
    "strategyinfo": "StrategyInfo",
    "team": "Deployments Whereabouts",
    "world": "Manoeuvres News RobotReport World",
    "zones": "DatedZone Zone ZoneChange ZoneKind",
}
# the module that defines each name
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    return value
