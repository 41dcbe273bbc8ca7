"""Faults over reports: what the simulator does to robots, its client reports, and the mission copes with it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mission_setup import Driver, body, body_of, brief_from, open_missions, over_reports, send, started, team
from support.missions.faulty_mission import explored, yard
from support.missions.mixed_team import BARGE, TRACKED, TRUCK, WHEELED, stored
from support.missions.small_teams import CORRIDOR, carrier_at, drawn_grid, kinds_of

from marsupial.errors import ScenarioError
from marsupial.formats.missionlog import parse_log
from marsupial.formats.scenario import read_scenario
from marsupial.model import Cell, MissionEnded, MissionStarted, Planned, RobotReturned, SpeedChanged
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.mission import Cause, Revealed, Status
from marsupial.model.robots import default_types
from marsupial.model.team import Whereabouts
from marsupial_service.missions.reported import ReportedRobot, ReportedTeam
from marsupial_service.missions.simulated import SimulatedTeam
from marsupial_service.missions.state import ReportConflict
from marsupial_service.missions.values import Control
from marsupial_service.schemas.enums import MissionPhase


async def test_a_mission_with_all_faults_is_completed_over_reports(place: str) -> None:
    log, driver = await over_reports(place, yard())
    events = parse_log(log.encode()).events
    end = events[-1]
    assert isinstance(end, MissionEnded)
    assert (end.status, end.coverage, end.aboard) == (Status.COMPLETE, 1.0, ("r1", "r2", "r3"))
    assert [event.robot for event in events if isinstance(event, RobotReturned)] == ["r3"]
    assert {event.robot: event.share for event in events if isinstance(event, SpeedChanged)} == {"c1": 0.5, "r1": 0.8}
    triggers = {trigger.cause for event in events if isinstance(event, Planned) for trigger in event.trigger}
    assert triggers >= {Cause.FAILED, Cause.LOST, Cause.RETURNED, Cause.SPEED}
    sent = {key for report in driver.reports for key, value in report.items() if value}
    assert sent >= {"failed", "declined", "lost", "returned"}


def test_a_robot_whose_drive_fails_at_once_reports_where_it_stands() -> None:
    truth = drawn_grid(*CORRIDOR)
    falls = Fault(kind=FaultKind.GROUND, area=(Cell(3, 1), Cell(3, 1)), terrain=0, at_ms=1000)
    team = SimulatedTeam(truth, kinds_of(), [carrier_at(2, 1)], [falls], 10_000)
    batch: dict[str, Any] = {"n": 0, "until_ms": 0, "commands": []}
    assert team.answer(batch) is not None
    assert team.answer(batch | {"n": 1, "until_ms": 2000}) is not None
    drive = {"id": 1, "robot": "c1", "name": "drive", "route": [[2, 1], [3, 1], [4, 1]]}
    report = team.answer(batch | {"n": 2, "until_ms": 9000, "commands": [drive]})
    assert report is not None
    assert [one["id"] for one in report["failed"]] == [1]
    assert [one["cell"] for one in report["robots"]] == [[2, 1]]


async def test_a_slowdown_as_a_robot_reaches_a_cell_is_the_same_over_reports(tmp_path: Path) -> None:
    scenario = yard("faults: [{fault: slows, robot: c1, at_s: 1, speed_share: 0.5}]\n")
    log, _ = await over_reports(tmp_path, scenario)
    events, (_, expected) = parse_log(log.encode()).events, explored(scenario)
    assert any(isinstance(event, Revealed) and (event.t_ms, event.robot) == (1000, "c1") for event in expected)
    assert events[1:] == expected[1:]


async def test_a_mission_with_seats_by_type_is_completed_over_reports(tmp_path: Path) -> None:
    team = [TRUCK, BARGE, WHEELED, WHEELED | {"name": "w2"}, TRACKED]
    scenario = read_scenario(stored(tmp_path, team))
    kinds = body_of(scenario)["robot_types"]
    assert [kind.get("seats") for kind in kinds][:2] == [{"wheeled": 2}, {"tracked": 1, "wheeled": 1}]
    log, _ = await over_reports(tmp_path, scenario)
    events = parse_log(log.encode()).events
    assert isinstance(events[0], MissionStarted)
    assert [kind.seats for kind in events[0].types] == [kind.seats for kind in scenario.robot_types]
    assert isinstance(events[-1], MissionEnded)
    assert (events[-1].status, len(events[-1].aboard)) == (Status.COMPLETE, 3)


async def test_a_lost_robot_returns_and_reports_in_one_breath(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        driver = Driver(team())
        await driver.drive(missions, record, 3)
        n, t_ms = driver.reports[-1]["n"], driver.reports[-1]["t_ms"]
        gone = {"n": n + 1, "t_ms": t_ms, "lost": [{"robot": "rover1_1", "reason": "battery"}]}
        record = await send(missions, record, gone)
        with pytest.raises(ReportConflict, match="rover1_1 is lost"):
            await send(missions, record, {"n": n + 2, "t_ms": t_ms, "robots": [{"name": "rover1_1"}]})
        back = {
            "n": n + 2,
            "t_ms": t_ms,
            "returned": ["rover1_1"],
            "robots": [{"name": "rover1_1", "speed_share": 0.5}],
        }
        await send(missions, record, back)
        await missions.control(record, Control.CANCEL)


@pytest.mark.parametrize("paused", [False, True])
async def test_a_mission_that_winds_down_recovers_its_rovers(tmp_path: Path, paused: bool) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions, "office")
        driver = Driver(team("office"))
        await driver.drive(missions, record, 40)
        if paused:
            await missions.control(record, Control.PAUSE)
        assert (await missions.control(record, Control.WIND_DOWN)).state is MissionPhase.WINDING_DOWN
        await driver.drive(missions, record)
        end = parse_log((await missions.log(record)).encode()).events[-1]
    assert isinstance(end, MissionEnded)
    assert (end.status, len(end.aboard)) == (Status.CANCELLED, 4)
    assert end.reason == "called back by the operator, all rovers are aboard"
    assert end.coverage < 0.9


@pytest.mark.parametrize(("capacity", "seats"), [(1, False), (2, True)])
def test_a_lost_rover_whose_place_was_taken_does_not_return(capacity: int, seats: bool) -> None:
    places = {"c1": Whereabouts("here"), "a": Whereabouts(None, "c1"), "b": Whereabouts(None, "c1")}
    carrier, rover = default_types(capacity)
    if seats:
        carrier = replace(carrier, seats=((rover.name, 1),))
    robots = {name: ReportedRobot(where) for name, where in places.items()}
    reported = ReportedTeam(robots, {"c1": carrier, "a": rover, "b": rover})
    assert reported.mark_lost("a") == ("a",)
    assert reported.mark_returned("a") == ()
    assert reported.mark_lost("c1") == ("c1", "b")
    assert reported.mark_returned("b") == ()
    assert reported.mark_returned("c1") == ("c1", "b")
    assert reported.mark_returned("a") == ()


def test_a_share_of_an_area_that_is_not_known_is_refused() -> None:
    with pytest.raises(ScenarioError, match="coverage: needs the area"):
        brief_from({key: value for key, value in body().items() if key != "area"} | {"coverage": 0.5})
