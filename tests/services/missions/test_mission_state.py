"""Where the service takes rovers to be: when their carrier is lost, and when a state is rebuilt."""

import json
from collections.abc import Mapping

import pytest
from mission_setup import brief

from marsupial_service.missions.state import MissionState, ReportConflict
from marsupial_service.missions.values import MissionReport, StoredEvent
from marsupial_service.schemas.enums import EventType

UNDOCK = {"id": 1, "name": "undock", "robot": "rover1_1", "carrier": "carrier1", "cell": [3, 3]}


def sent(n: int, *commands: Mapping[str, object]) -> StoredEvent:
    """Return the batch of commands that considered the first `n` reports."""
    return StoredEvent(EventType.COMMANDS, json.dumps({"revision": 1, "n": n, "commands": commands}))


def state_after(*commands: Mapping[str, object]) -> MissionState:
    """Return the state of a mission whose first carrier is lost once these commands were given."""
    state = MissionState(brief("lobby"))
    state.follow([sent(0, *commands)], ())
    state.apply(MissionReport(n=1, t_ms=0, lost=[{"robot": "carrier1", "reason": "battery"}]), b"")
    return state


def seen(rover: str) -> MissionReport:
    return MissionReport(n=2, t_ms=1, robots=[{"name": rover, "cell": (3, 3)}])


def test_a_rover_aboard_is_lost_with_its_carrier() -> None:
    with pytest.raises(ReportConflict, match="rover1_1 is lost"):
        state_after().check(seen("rover1_1"))


def test_a_rover_that_is_being_set_down_is_not_lost_with_its_carrier_but_those_aboard_are() -> None:
    state = state_after(UNDOCK)
    state.check(seen("rover1_1"))
    with pytest.raises(ReportConflict, match="rover1_2 is lost"):
        state.check(seen("rover1_2"))


@pytest.mark.parametrize("outcome", ["finished", "failed"])
def test_a_rebuilt_state_knows_where_a_rover_is_that_was_set_down_again(outcome: str) -> None:
    events, reports = [], []
    for n, name in enumerate(("undock", "dock", "undock")):
        events.append(sent(n, {**UNDOCK, "id": n + 1, "name": name}))
        jammed = outcome == "failed" and n == 2
        end = {"failed": [{"id": n + 1, "reason": "jammed"}]} if jammed else {"finished": [n + 1]}
        reports.append((MissionReport(n=n + 1, t_ms=n, **end), bytes([n])))
    followed, rebuilt = MissionState(brief("lobby")), MissionState(brief("lobby"))
    for event, report in zip(events, reports, strict=True):
        followed.follow([event], [report])
    rebuilt.follow(events, reports)
    faults = []
    for state in (followed, rebuilt):
        try:
            state.check(MissionReport(n=4, t_ms=3, robots=[{"name": "rover1_1", "cell": (3, 3)}]))
            faults.append("")
        except ReportConflict as error:
            faults.append(str(error))
    assert faults == 2 * ["" if outcome == "finished" else "robots[0]: rover1_1 is aboard carrier1"]
