"""Missions over reports whose robots are lost: how they end, when they wait, and that they go on."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mission_setup import Hosted, brief_from, read_report
from test_waiting_missions import events_of_kind, reported

from marsupial.model.grid import FLOOR, OBSTACLE
from marsupial.model.runs import known_runs
from marsupial_service.missions.encoding import decode_input, encode_input
from marsupial_service.missions.values import Control, MissionBatch, MissionReport, PendingInput
from marsupial_service.schemas.enums import EventType

ROOM = np.pad(np.full((4, 8), FLOOR, dtype=np.uint8), 1, constant_values=OBSTACLE)
LOST: dict[str, Any] = {"lost": [{"robot": "r0", "reason": "battery"}]}
EXPECTED: dict[str, Any] = {"lost": [{"robot": "r0", "reason": "battery", "returns": True}]}


def asked() -> dict[str, Any]:
    """Return the body of a mission in a room: c1 in one corner, r0 in another one."""
    kind = {"speed_mps": 1.0, "sensor_range_m": 20.0, "radius_m": 0.1, "terrains": ["floor"]}
    return {
        "frame": {"width": 10, "height": 6, "resolution_m": 0.5, "origin_m": [0, 0, 0]},
        "robot_types": [
            {"name": "carrier", "role": "carrier", "capacity": 1, **kind},
            {"name": "rover", "role": "rover", "dock_s": 2, "undock_s": 2, **kind},
        ],
        "team": [{"name": "c1", "type": "carrier", "cell": [1, 1]}, {"name": "r0", "type": "rover", "cell": [8, 4]}],
        "goal": {"recover_rovers": True},
        "planner": "greedy",
        "budget": {"steps": 1},
        "time_limit_ms": 1_000_000,
    }


@contextmanager
def hosted() -> Iterator[Hosted]:
    with Hosted(brief_from(asked())) as mission:
        mission.batch(PendingInput(input=None))
        yield mission


def end_of(turn: MissionBatch) -> dict[str, Any]:
    (end,) = events_of_kind(turn, EventType.END)
    (line,) = (line for line in events_of_kind(turn, EventType.LOG) if line["event"] == "ended")
    return {**line, **end}


def test_a_mission_whose_rover_is_reported_lost_outside_is_not_complete() -> None:
    with hosted() as mission:
        end = end_of(reported(mission, 1, 0, map={"runs": known_runs(ROOM)}, **LOST))
        assert (end["status"], end["aboard"], end["lost"]) == ("stalled", [], ["r0"])
        assert end["reason"] == "no reachable target is left, but r0 is not aboard; lost: r0 at (4.2, 2.2)"


def test_a_mission_waits_for_a_lost_rover_that_is_expected_and_fetches_it() -> None:
    with hosted() as mission:
        turn = reported(mission, 1, 0, map={"runs": known_runs(ROOM)}, **EXPECTED)
        assert events_of_kind(turn, EventType.STATE) == [
            {"state": "waiting", "reason": "lost, expected back: r0 at (4.2, 2.2)", "t_ms": 0}
        ]
        for n in (2, 3):  # reports without news make no plans
            turn = reported(mission, n, 50_000 * n)
            assert [line["event"] for line in events_of_kind(turn, EventType.LOG)] == []
        turn = reported(mission, 4, 300_000, returned=["r0"])
        assert [state["state"] for state in events_of_kind(turn, EventType.STATE)] == ["running"]
        for n in range(5, 12):
            given = [command["id"] for command in events_of_kind(turn, EventType.COMMANDS)[0]["commands"]]
            turn = reported(mission, n, 300_000 + 10_000 * n, finished=given)
            if turn.over:
                break
        end = end_of(turn)
        assert (end["status"], end["aboard"], end.get("lost")) == ("complete", ["r0"], None)


def test_a_wait_for_a_lost_rover_ends_when_it_is_expected_no_more_or_the_operator_ends_it() -> None:
    with hosted() as mission:
        reported(mission, 1, 0, map={"runs": known_runs(ROOM)}, **EXPECTED)
        end = end_of(reported(mission, 2, 1000, **LOST))
        assert (end["status"], end["t_ms"]) == ("stalled", 1000)
    with hosted() as mission:
        reported(mission, 1, 0, map={"runs": known_runs(ROOM)}, **EXPECTED)
        end = end_of(mission.batch(PendingInput(input=Control.WIND_DOWN)))
        assert end["status"] == "cancelled"
        assert end["reason"] == (
            "called back by the operator, but r0 is not aboard; lost, expected back: r0 at (4.2, 2.2)"
        )


def test_who_is_expected_back_is_read_and_stored_with_a_report() -> None:
    brief = brief_from(asked())
    body = {"n": 1, "t_ms": 0, "lost": [{"robot": "r0", "returns": True}, {"robot": "c1", "reason": "battery"}]}
    report = read_report(brief, body)
    again = decode_input(encode_input(report))
    assert isinstance(again, MissionReport)
    assert [(one.robot, one.reason, one.returns) for one in again.lost] == [("r0", "", True), ("c1", "battery", False)]
