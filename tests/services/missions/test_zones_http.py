"""Zones over HTTP: added, replaced and removed during a mission; controls while it winds down."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mission_setup import Driver, Hosted, body, brief, brief_from, open_missions, over_reports, started, team
from support.missions.faulty_mission import explored, yard
from support.missions.zone_rules import trespasses
from support.services.servers import Server

from marsupial.errors import ScenarioError
from marsupial.formats.missionlog import parse_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.model import MissionEnded, Zone, ZoneChange, ZoneKind
from marsupial.model.grid import UNKNOWN
from marsupial.model.mission import Status, ZoneChanged
from marsupial.model.runs import known_runs
from marsupial.model.zones import MOST_ZONES
from marsupial_client import Client, Conflict, Refused
from marsupial_service.entries.records import KeyReused
from marsupial_service.missions.state import ReportConflict
from marsupial_service.missions.values import Control, MissionReport, PendingInput
from marsupial_service.schemas.enums import EventType, MissionPhase

GRID = builtin_scenario("lobby").grid
SQUARE = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))


def no_go(name: str, *corners: tuple[float, float]) -> ZoneChange:
    return ZoneChange(name=name, zone=Zone(kind=ZoneKind.NO_GO, polygon_m=corners or SQUARE))


@pytest.mark.parametrize(
    "zones",
    [
        "zones: [{name: east, kind: no_go, polygon_m: [[9, 0], [11, 0], [11, 6], [9, 6]], from_s: 6, until_s: 20}]\n",
        "zones: [{name: area, kind: explore, polygon_m: [[0, 0], [7, 0], [7, 6], [0, 6]]}]\n",
    ],
)
async def test_the_zones_of_a_mission_over_reports_are_those_of_a_scenario(tmp_path: Path, zones: str) -> None:
    log, _ = await over_reports(tmp_path, yard(zones))
    assert parse_log(log.encode()).events[1:] == explored(yard(zones))[1][1:]


async def test_a_zone_holds_from_the_moment_it_is_added(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        driver = Driver(team())
        await driver.drive(missions, record, 12)
        x, y = GRID.centre_m(next(r.cell for r in brief().robots if r.cell is not None))
        around = ((x - 1, y - 1), (x + 1, y - 1), (x + 1, y + 1), (x - 1, y + 1))
        assert [zone.name for zone in await missions.change_zone(record, no_go("start", *around))] == ["start"]
        inputs = (await missions.of("me", record.id)).inputs
        await missions.change_zone(record, no_go("start", *around))  # again: nothing changes
        assert (await missions.of("me", record.id)).inputs == inputs
        await driver.drive(missions, record)
        assert [zone.name for zone in await missions.zones(record)] == ["start"]
        events = parse_log((await missions.log(record)).encode()).events
        with pytest.raises(ReportConflict, match="has ended"):
            await missions.change_zone(record, no_go("late"))
    assert [event.name for event in events if isinstance(event, ZoneChanged)] == ["start"]
    assert not list(trespasses(GRID, events))
    assert isinstance(events[-1], MissionEnded)
    assert events[-1].status is Status.COMPLETE


async def test_a_mission_has_its_zones_after_a_restart_of_the_service(place: str) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        await missions.change_zone(record, no_go("one", (20.0, 20.0), (21.0, 20.0), (21.0, 21.0)))
        await missions.change_zone(record, no_go("two", (20.0, 20.0), (21.0, 20.0), (21.0, 21.0)))
        await missions.change_zone(record, ZoneChange(name="one", zone=None))
    async with open_missions(place) as missions:
        record = await missions.of("me", record.id)
        assert [zone.name for zone in await missions.zones(record)] == ["two"]
        await Driver(team()).drive(missions, record)
        events = parse_log((await missions.log(record)).encode()).events
    changes = [(e.name, e.zone is None) for e in events if isinstance(e, ZoneChanged)]
    assert changes == [("one", False), ("two", False), ("one", True)]


async def test_a_late_copy_of_a_request_adds_no_zone_again(place: str) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        for key in ("one", "two"):
            assert len(await missions.change_zone(record, no_go("lab"), key)) == 1
        for other in (ZoneChange(name="lab", zone=None), no_go("shop")):
            with pytest.raises(KeyReused):
                await missions.change_zone(record, other, "one")
        with pytest.raises(KeyReused):
            await missions.control(record, Control.PAUSE, "one")
        assert await missions.change_zone(record, ZoneChange(name="lab", zone=None), "three") == ()
        for key in ("one", "two"):
            assert await missions.change_zone(record, no_go("lab"), key) == ()
        await missions.control(record, Control.CANCEL)


async def test_the_number_of_zones_is_limited(place: str) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        for i in range(MOST_ZONES):
            await missions.change_zone(record, no_go(f"z{i}"))
        with pytest.raises(ReportConflict, match="the limit of 100 zones is reached"):
            await missions.change_zone(record, no_go("more"))
        await missions.control(record, Control.CANCEL)


async def test_a_pause_of_a_team_that_returns_ends_in_its_return(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions, "office")
        driver = Driver(team("office"))
        await driver.drive(missions, record, 40)
        await missions.control(record, Control.WIND_DOWN)
        assert (await missions.control(record, Control.RESUME)).state is MissionPhase.WINDING_DOWN
        assert (await missions.control(record, Control.PAUSE)).state is MissionPhase.PAUSED
        assert (await missions.control(record, Control.RESUME)).state is MissionPhase.WINDING_DOWN
        await driver.drive(missions, record)
    told = [json.loads(data)["state"] for _, kind, data in driver.events if kind == "state"]
    assert told == ["winding_down", "paused", "winding_down"]


def test_many_zones_at_one_moment_do_not_stall_a_mission() -> None:
    with Hosted(brief("lobby")) as hosted:
        hosted.batch(PendingInput(input=None))
        truth = builtin_scenario("lobby").grid.solid().cells
        cells = np.full_like(truth, UNKNOWN)
        x, y = next(robot.cell for robot in brief("lobby").robots if robot.cell is not None)
        window = np.s_[max(0, y - 12) : y + 12, max(0, x - 12) : x + 12]
        cells[window] = truth[window]
        assert not hosted.batch(PendingInput(input=MissionReport(n=1, t_ms=0, map={"runs": known_runs(cells)}))).over
        for i in range(20):
            assert not hosted.batch(PendingInput(input=no_go(f"z{i}", (-3.0, -3.0), (-2.0, -3.0), (-2.0, -2.0)))).over


@pytest.mark.parametrize("reports", [0, 1])
def test_a_mission_that_waits_for_its_first_map_hears_that_it_is_to_wind_down(reports: int) -> None:
    with Hosted(brief("lobby")) as hosted:
        turn = hosted.batch(PendingInput(input=None))
        if reports:
            turn = hosted.batch(PendingInput(input=MissionReport(n=1, t_ms=0)))
        assert not turn.over
        turn = hosted.batch(PendingInput(input=Control.WIND_DOWN))
        assert turn.over
        (end,) = [json.loads(event.data) for event in turn.events if event.type is EventType.END]
        assert end["status"] == "cancelled"
        assert end["reason"].startswith("called back by the operator")


def zones_of(**zone: Any) -> dict[str, Any]:
    corners = [[20, 20], [21, 20], [21, 21]]
    return {**body(), "zones": [{"name": "a", "kind": "no_go", "polygon_m": corners, **zone}]}


@pytest.mark.parametrize(
    ("zone", "fault"),
    [
        ({"weight": 2}, r"zones\[0\].weight: only zones 'priority' have it"),
        ({"kind": "priority"}, r"zones\[0\].weight: missing"),
        ({"from_s": 3, "until_s": 2}, r"zones\[0\].until_s: must be after from_s"),
        ({"polygon_m": [[-99, -99], [99, -99], [99, 99], [-99, 99]]}, r"zones\[0\].polygon_m: .* starts there"),
    ],
)
def test_a_mission_with_a_wrong_zone_is_refused(zone: dict[str, Any], fault: str) -> None:
    assert brief_from(zones_of()).zones[0].name == "a"
    with pytest.raises(ScenarioError, match=fault):
        brief_from(zones_of(**zone))


def test_a_client_adds_and_removes_zones(server: Server) -> None:
    asked = body() | {"goal": {"recover_rovers": True, "return_home": True}}
    with Client(server.url) as client:
        mission = client.begin(asked)  # type: ignore[arg-type]
        corners = [[20.0, 20.0], [21.0, 20.0], [21.0, 21.0]]
        lab = {"name": "lab", "kind": "priority", "polygon_m": corners, "weight": 3.0}
        assert mission.set_zone("lab", {"kind": "priority", "polygon_m": corners, "weight": 3}) == [lab]
        assert mission.zones() == [lab]
        for zone, where in (
            ({"kind": "no_go", "polygon_m": [[-99, -99], [99, -99], [99, 99], [-99, 99]]}, "its home"),
            ({"kind": "no_go", "polygon_m": corners, "weight": 3}, "/weight"),
            ({"kind": "priority", "polygon_m": corners}, "/weight"),
            ({"kind": "no_go", "polygon_m": corners[:2]}, "/polygon_m"),
            ({"kind": "closed", "polygon_m": corners}, "/kind"),
        ):
            with pytest.raises(Refused, match=where):
                mission.set_zone("lab", zone)  # type: ignore[arg-type]
        with pytest.raises(Refused):
            mission.set_zone("no name", {"kind": "no_go", "polygon_m": corners})
        assert mission.remove_zone("lab") == []
        assert mission.remove_zone("lab") == []
        mission.cancel()
        with pytest.raises(Conflict):
            mission.set_zone("lab", {"kind": "no_go", "polygon_m": corners})
