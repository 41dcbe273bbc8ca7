"""The consequences of a lost carrier for its rovers."""

import json
from collections.abc import Mapping

import pytest
from mission_setup import brief

from marsupial.model.grid import Cell
from marsupial_service.missions.state import MissionState, ReportConflict
from marsupial_service.missions.values import MissionReport, RobotUpdate, StoredEvent
from marsupial_service.schemas.enums import EventType

UNDOCK = {"id": 1, "name": "undock", "robot": "rover1_1", "carrier": "carrier1", "cell": [3, 3]}


def state_after(*commands: Mapping[str, object]) -> MissionState:
    """Return the state of a mission whose first carrier is lost once these commands were given."""
    state = MissionState(brief("lobby"))
    state.apply_event(StoredEvent(EventType.COMMANDS, json.dumps({"revision": 1, "commands": commands})))
    state.apply(MissionReport(n=1, t_ms=0, lost=(("carrier1", "battery"),)), b"")
    return state


def seen(rover: str) -> MissionReport:
    return MissionReport(n=2, t_ms=1, robots=(RobotUpdate(name=rover, cell=Cell(3, 3)),))


def test_a_rover_aboard_is_lost_with_its_carrier() -> None:
    with pytest.raises(ReportConflict, match="rover1_1 is lost"):
        state_after().check(seen("rover1_1"))


def test_a_rover_that_is_being_set_down_is_not_lost_with_its_carrier_but_those_aboard_are() -> None:
    state = state_after(UNDOCK)
    state.check(seen("rover1_1"))
    with pytest.raises(ReportConflict, match="rover1_2 is lost"):
        state.check(seen("rover1_2"))
