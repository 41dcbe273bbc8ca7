"""Batteries over reports: missions have the logs of simulated ones, and estimate the charges that nobody reports."""

from pathlib import Path
from typing import Any

import pytest
from mission_setup import Reports, body_of, brief_from, over_reports, read_report
from service_requests import client, pointers, problem
from support.missions.battery_yard import battery_yard
from support.missions.faulty_mission import explored
from support.services.servers import Server

from marsupial.errors import ScenarioError
from marsupial.formats.missionlog import parse_log
from marsupial.model import Cell
from marsupial.model.missionframe import MissionFrame
from marsupial_service.missions.encoding import decode_input, encode_input
from marsupial_service.missions.values import MissionReport
from marsupial_service.missions.world import RemoteWorld
from marsupial_service.schemas.missions import RobotNoteBody


@pytest.mark.parametrize(("seed", "faults"), [(1, False), (2, True)])
async def test_a_mission_has_the_log_of_the_simulator_even_if_the_service_restarts(
    tmp_path: Path, seed: int, faults: bool
) -> None:
    scenario = battery_yard(seed, faults=faults)
    log, driver = await over_reports(tmp_path, scenario, 12)
    assert parse_log(log.encode()).events == tuple(explored(scenario)[1])
    notes = [note for report in driver.reports for note in report["robots"]]
    assert any("charge" in note for note in notes)
    assert not all("charge" in note for note in notes), "most charges are as estimated"


class Charged:
    """A mission by scripted reports. Carriers: 20 kJ, 20 W to stand, 60 W more to drive, 100 W to charge."""

    def __init__(self) -> None:
        self.inbox = Reports()
        self.world = RemoteWorld(brief_from(body_of(battery_yard())), self.inbox)
        self.n = 0
        self.report(0)

    def report(self, t_ms: int, *notes: RobotNoteBody, **more: Any) -> Any:
        self.n += 1
        self.inbox.coming.append(MissionReport(n=self.n, t_ms=t_ms, robots=list(notes), **more))
        return self.world.advance(t_ms)

    def charge_j(self, name: str) -> float:
        robot = next(robot for robot in self.world.robots() if robot.name == name)
        kind = next(kind for kind in battery_yard().robot_types if kind.name == robot.type)
        assert kind.battery is not None
        assert robot.charge is not None
        return robot.charge * kind.battery.capacity_j


def test_charges_are_estimated_as_the_simulator_computes_them() -> None:
    team = Charged()
    full_j = team.charge_j("c1")
    team.report(10_000)
    assert team.charge_j("c1") == pytest.approx(full_j - 10 * 20)
    team.world.drive("c1", [Cell(3, 2), Cell(4, 3), Cell(4, 4)])
    team.report(11_500, RobotNoteBody(name="c1", cell=Cell(4, 4)), finished=[1])
    driven_j = full_j - 11.5 * 20 - 1.5 * 60
    assert team.charge_j("c1") == pytest.approx(driven_j)
    team.report(12_500)
    assert team.charge_j("c1") == pytest.approx(driven_j + 100), "it stands at a charging place"
    team.report(90_000)
    assert team.charge_j("c1") == full_j


def test_a_reported_charge_replaces_the_estimate_and_a_low_one_leads_to_a_new_plan() -> None:
    team = Charged()
    assert team.report(1000, RobotNoteBody(name="c1", charge=0.97), RobotNoteBody(name="r1", charge=1.0)).drained == ()
    assert team.charge_j("c1") == pytest.approx(0.97 * 20_000)
    news = team.report(2000, RobotNoteBody(name="c1", charge=0.94))
    assert news.drained == ("c1",), "3 % twice"
    assert team.report(3000, RobotNoteBody(name="c1", charge=0.0)).lost == (), "it says itself whether it is lost"
    assert team.charge_j("c1") == 0.0
    team.report(9000, RobotNoteBody(name="c1", charge=0.5))
    assert team.charge_j("c1") == pytest.approx(0.5 * 20_000)


def test_a_lost_robot_uses_no_charge_until_it_returns() -> None:
    team = Charged()
    full_j = team.charge_j("c2")
    team.report(1000, lost=[{"robot": "c2", "reason": "off"}])
    team.report(50_000, returned=["c2"])
    assert team.charge_j("c2") == pytest.approx(full_j - 20)


def test_charging_places_stay_in_place_as_the_map_grows() -> None:
    team = Charged()
    team.report(1000, frame=MissionFrame(-5, -3, 60, 40))
    assert team.world.grid.chargers == (Cell(9, 7), Cell(29, 5))


def test_a_charge_is_stored_with_and_without_a_speed() -> None:
    notes = [
        RobotNoteBody(name="a", charge=0.5),
        RobotNoteBody(name="b", speed_share=0.5, charge=0.25),
        RobotNoteBody(name="c", speed_share=0.5),
        RobotNoteBody(name="d"),
    ]
    report = MissionReport(n=1, t_ms=0, robots=notes)
    stored = decode_input(encode_input(report))
    assert isinstance(stored, MissionReport)
    assert stored.robots == notes


@pytest.mark.parametrize(
    ("chargers", "fault"),
    [
        ([{"at_m": [99, 0]}], "chargers[0].at_m: [99, 0] is outside the map"),
        ([{"cell": [4, 4]}, {"cell": [0, 4]}], "chargers[1].cell: is an obstacle"),
    ],
)
def test_a_charging_place_off_the_ground_is_refused(chargers: list[dict[str, Any]], fault: str) -> None:
    document = body_of(battery_yard()) | {"chargers": chargers}
    document["frame"]["known"] = [4 * 30, 1, 0]
    with pytest.raises(ScenarioError) as refused:
        brief_from(document)
    assert fault in str(refused.value)


def test_a_robot_without_a_battery_reports_no_charge() -> None:
    document = body_of(battery_yard())
    del document["robot_types"][1]["battery"]
    brief = brief_from(document)
    report = {"n": 1, "t_ms": 0, "robots": [{"name": "c1", "charge": 0.5}, {"name": "r1", "charge": 0.5}]}
    with pytest.raises(ScenarioError, match=r"robots\[1\].charge: a rover has no battery"):
        read_report(brief, report)


@pytest.mark.parametrize("charge", [-0.1, 1.5, None, "full"])
def test_a_charge_that_is_none_is_refused(server: Server, charge: object) -> None:
    with client(server) as http:
        mission = http.post("/v1/missions", json=body_of(battery_yard())).json()["id"]
        report = {"n": 1, "t_ms": 0, "robots": [{"name": "c1", "charge": charge}]}
        answer = http.post(f"/v1/missions/{mission}/reports", json=report)
        assert pointers(problem(answer, 422, "invalid")) == ["/robots/0/charge"]
        http.post(f"/v1/missions/{mission}/cancel")
