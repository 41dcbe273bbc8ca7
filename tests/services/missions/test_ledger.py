"""What the ledger takes a carrier that is lost to mean for its rovers."""

from __future__ import annotations

import json
from collections.abc import Mapping

import pytest
from mission_house import brief

from marsupial.model.grid import Cell
from marsupial_service.missions.ledger import Conflict, Ledger
from marsupial_service.missions.values import Event, EventType, Report, RobotNote

UNDOCK = {"id": 1, "name": "undock", "robot": "rover1_1", "carrier": "carrier1", "cell": [3, 3]}


def ledger_after(*commands: Mapping[str, object]) -> Ledger:
    """Return the ledger of a mission whose first carrier is lost once these commands were given."""
    ledger = Ledger(brief("lobby"))
    ledger.publish(Event(EventType.COMMANDS, json.dumps({"revision": 1, "commands": commands})))
    ledger.take(Report(n=1, t_ms=0, lost=(("carrier1", "battery"),)), b"")
    return ledger


def seen(rover: str) -> Report:
    return Report(n=2, t_ms=1, robots=(RobotNote(name=rover, cell=Cell(3, 3)),))


def test_a_rover_aboard_is_lost_with_its_carrier() -> None:
    with pytest.raises(Conflict, match="rover1_1 is lost"):
        ledger_after().check(seen("rover1_1"))


def test_a_rover_that_is_being_set_down_is_not_lost_with_its_carrier_but_those_aboard_are() -> None:
    ledger = ledger_after(UNDOCK)
    ledger.check(seen("rover1_1"))
    with pytest.raises(Conflict, match="rover1_2 is lost"):
        ledger.check(seen("rover1_2"))
