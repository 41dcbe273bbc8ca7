"""Missions that wait instead of ending: for their first map, for robots in obstacles, and during a pause."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mission_setup import Hosted, body, brief, brief_from

from marsupial.errors import ScenarioError
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.grid import OBSTACLE, UNKNOWN
from marsupial.model.runs import known_runs
from marsupial_service.missions.values import Control, MissionBatch, MissionReport, PendingInput
from marsupial_service.schemas.enums import EventType

TRUTH = builtin_scenario("lobby").grid.solid().cells


def events_of_kind(turn: MissionBatch, kind: EventType) -> list[dict[str, Any]]:
    return [json.loads(event.data) for event in turn.events if event.type is kind]


def until(turn: MissionBatch) -> int:
    (commands,) = events_of_kind(turn, EventType.COMMANDS)
    return int(commands["until_ms"])


def around_the_team(margin: int = 12) -> Any:
    """Return the cells of the lobby around the first robot."""
    cell = next(robot.cell for robot in brief("lobby").robots if robot.cell is not None)
    cells = np.full_like(TRUTH, UNKNOWN)
    window = slice(max(0, cell.y - margin), cell.y + margin), slice(max(0, cell.x - margin), cell.x + margin)
    cells[window] = TRUTH[window]
    return cells


def walled() -> Any:
    cells = around_the_team()
    cells[cells != UNKNOWN] = OBSTACLE
    return cells


def reported(hosted: Hosted, n: int, t_ms: int, **told: Any) -> MissionBatch:
    return hosted.batch(PendingInput(input=MissionReport(n=n, t_ms=t_ms, **told)))


def test_a_mission_without_known_cells_waits_for_its_first_map() -> None:
    with Hosted(brief("lobby")) as hosted:
        hosted.batch(PendingInput(input=None))
        turn = reported(hosted, 1, 0)
        (state,) = events_of_kind(turn, EventType.STATE)
        assert state["state"] == "waiting"
        assert "the cell is unknown" in state["reason"]
        for n in range(2, 8):
            assert not turn.over
            assert until(turn) > 0
            turn = reported(hosted, n, 100_000 * n)
        turn = reported(hosted, 8, 800_000, map={"runs": known_runs(around_the_team())})
        assert [state["state"] for state in events_of_kind(turn, EventType.STATE)] == ["running"]
        plans = [line for line in events_of_kind(turn, EventType.LOG) if line["event"] == "plan"]
        assert plans[0]["trigger"] == "start"
        assert events_of_kind(turn, EventType.COMMANDS)[0]["commands"]


def test_robots_that_the_map_shows_inside_obstacles_do_not_complete_a_mission() -> None:
    with Hosted(brief("lobby")) as hosted:
        hosted.batch(PendingInput(input=None))
        turn = reported(hosted, 1, 0, map={"runs": known_runs(walled())})
        assert not turn.over
        assert "the cell is obstacle" in events_of_kind(turn, EventType.STATE)[0]["reason"]
        turn = reported(hosted, 2, 10, map={"runs": known_runs(around_the_team())})
        assert events_of_kind(turn, EventType.COMMANDS)[0]["commands"]
        turn = reported(hosted, 3, 20, map={"runs": known_runs(walled())})
        assert not turn.over


def test_a_mission_that_has_begun_waits_a_minute_for_a_map_on_which_its_robots_can_stand_and_is_then_stalled() -> None:
    with Hosted(brief("lobby")) as hosted:
        hosted.batch(PendingInput(input=None))
        turn = reported(hosted, 1, 0, map={"runs": known_runs(around_the_team())})
        given = [command["id"] for command in events_of_kind(turn, EventType.COMMANDS)[0]["commands"]]
        turn = reported(hosted, 2, 10, map={"runs": known_runs(walled())}, finished=given)
        assert not turn.over
        assert until(turn) == 60_010
        turn = reported(hosted, 3, 60_010)
        (end,) = events_of_kind(turn, EventType.END)
        assert end["status"] == "stalled"
        assert "can't stand" in end["reason"]


def test_during_a_pause_the_next_report_is_due_in_the_future() -> None:
    asked = replace(brief("lobby"), limits=replace(brief("lobby").limits, time_ms=5000))
    with Hosted(asked) as hosted:
        hosted.batch(PendingInput(input=None))
        reported(hosted, 1, 0, map={"runs": known_runs(around_the_team())})
        turn = hosted.batch(PendingInput(input=Control.PAUSE))
        for n, t_ms in ((2, 900), (3, 3000), (4, 9000)):
            assert until(turn) > t_ms - 900
            turn = reported(hosted, n, t_ms)
            assert until(turn) > t_ms


def test_a_robot_on_a_known_obstacle_is_refused_at_once() -> None:
    asked = body("lobby")
    cell = asked["team"][0]["cell"]
    asked["frame"]["known"] = [cell[1] * asked["frame"]["width"] + cell[0], 1, 0]
    with pytest.raises(ScenarioError, match="the cell is obstacle") as caught:
        brief_from(asked)
    assert caught.value.problems[0].path == "team[0].cell"


def test_a_drive_that_a_pause_has_cut_short_is_not_done() -> None:
    with Hosted(brief("lobby")) as hosted:
        hosted.batch(PendingInput(input=None))
        turn = reported(hosted, 1, 0, map={"runs": known_runs(around_the_team())})
        drive = events_of_kind(turn, EventType.COMMANDS)[0]["commands"][0]
        hosted.batch(PendingInput(input=Control.PAUSE))
        there = {"name": drive["robot"], "cell": drive["route"][1]}
        reported(hosted, 2, 1000, finished=[drive["id"]], robots=[there])
        turn = hosted.batch(PendingInput(input=Control.RESUME))
        ends = [line["end"] for line in events_of_kind(turn, EventType.LOG) if line["event"] == "end"]
        assert ends == ["failed"]
