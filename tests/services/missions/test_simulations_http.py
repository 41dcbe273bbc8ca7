import base64
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from PIL import Image
from service_requests import client, pointers, problem
from support.services.servers import Server
from support.waiting import wait_until
from uploaded_maps import YAML, on_map, picture

from marsupial import explore
from marsupial.formats.fields import Fields
from marsupial.formats.missionlog import parse_log
from marsupial.formats.scenario.faults import read_faults
from marsupial.generators.builtin import SCENARIOS, builtin_scenario
from marsupial.library.scenarios import load_scenario
from marsupial.model import Battery, MissionLimits, Planned, SpeedChanged
from marsupial.strategies.registry import strategy_infos, strategy_names

SMALL = {"scenario": "lobby", "carriers": 1, "rovers": 0, "planner": "greedy", "budget": {"steps": 1}, "speed": 0.1}


AWAY = {"name": "away", "kind": "no_go", "polygon_m": [[90, 90], [91, 90], [91, 91]]}


def test_simulation_options_are_listed_with_their_defaults(http: httpx.Client) -> None:
    found = http.get("/v1/scenarios").json()
    assert [one["name"] for one in found["scenarios"]] == list(SCENARIOS)
    by_name = {one["name"]: one for one in found["strategies"]}
    assert set(by_name) == set(strategy_names())
    how: dict[str, Any] = {"asks_planner": True, "with_rovers": True, "without_rovers": True}
    (how["summary"],) = (info.summary for info in strategy_infos() if info.name == "temporal")
    assert by_name["temporal"] == {"name": "temporal", **how}
    assert not by_name["closest-frontier"]["with_rovers"]
    assert "greedy" in found["planners"]
    assert (found["defaults"]["strategy"], found["defaults"]["budget"]) == ("temporal", {"seconds": 1.0})


def test_a_simulation_is_a_mission_with_its_simulation_settings(http: httpx.Client) -> None:
    answer = http.post("/v1/simulations", json={**SMALL, "seed": 7})
    mission = answer.json()
    assert answer.status_code == 201
    assert answer.headers["location"] == mission["links"]["self"]
    assert mission["simulation"] == {"speed": 0.1, "seed": 7, "carriers": 1, "rovers": 0, "warnings": []}
    assert http.get(mission["links"]["self"]).json()["simulation"] == mission["simulation"]
    problem(http.post(mission["links"]["reports"], json={"n": 1, "t_ms": 0}), 409, "conflict")
    assert http.post(mission["links"]["cancel"]).status_code == 200


def test_the_same_request_with_the_same_key_is_one_simulation(http: httpx.Client) -> None:
    key = {"Idempotency-Key": "once"}
    first, second = (http.post("/v1/simulations", json=SMALL, headers=key) for _ in range(2))
    assert (first.status_code, second.status_code) == (201, 200)
    assert first.json()["id"] == second.json()["id"]
    http.post(first.json()["links"]["cancel"])


@pytest.mark.parametrize("form", ["PNG", "PPM"])
def test_an_uploaded_map_is_explored_and_its_warnings_are_shown(http: httpx.Client, form: str) -> None:
    mission = http.post("/v1/simulations", json=on_map(image=picture(free=205, form=form))).json()
    assert mission["name"] == "room"
    assert any("205" in warning for warning in mission["simulation"]["warnings"])
    http.post(mission["links"]["cancel"])


def test_warnings_about_a_map_are_those_of_run(http: httpx.Client, tmp_path: Path) -> None:
    open_room = Image.new("L", (40, 30), 254)
    open_room.paste(0, (5, 5, 15, 15))
    open_room.save(tmp_path / "room.png")
    yaml = tmp_path / "room.yaml"
    yaml.write_text(YAML.replace("0.25\nor", "3.7\nor"))
    told = [text.removeprefix(f"{yaml}: ") for text in load_scenario(str(yaml), 1, 0).warnings()]
    image = base64.b64encode((tmp_path / "room.png").read_bytes()).decode()
    mission = http.post("/v1/simulations", json=on_map(yaml.read_text(), image, carriers=1, rovers=0)).json()
    assert mission["simulation"]["warnings"] == told
    assert any("leaks" in text for text in told)
    assert any("3.7 m per cell" in text for text in told)
    http.post(mission["links"]["cancel"])


def test_without_room_for_a_robot_warnings_about_the_map_follow_the_error(http: httpx.Client) -> None:
    refused = problem(http.post("/v1/simulations", json=on_map(image=picture(free=0))), 422, "invalid")
    first, *others = refused["errors"]
    assert "no room" in refused["detail"]
    assert "no room" in first["detail"]
    assert others
    assert all(one["detail"].startswith("warning: ") and one["pointer"] == "/map" for one in others)


@pytest.mark.parametrize(("chosen", "accepted"), [("room.png", True), ("room.pgm", True), ("mended.png", False)])
def test_the_image_must_be_the_one_named_in_the_yaml(http: httpx.Client, chosen: str, accepted: bool) -> None:
    body = on_map(YAML.replace("room.png", "maps/room.png"))
    answer = http.post("/v1/simulations", json={**body, "map": {**body["map"], "image_name": chosen}})
    if accepted:
        http.post(answer.json()["links"]["cancel"])
    else:
        told = {
            "pointer": "/map/image_base64",
            "detail": "must be the image that the yaml names, room.png, got mended.png",
        }
        assert problem(answer, 422, "invalid")["errors"] == [told]


@pytest.mark.parametrize(
    ("body", "pointer", "said"),
    [
        ({**SMALL, "scenario": "lobbi"}, "/scenario", "did you mean 'lobby'"),
        ({**SMALL, "strategy": "luck"}, "/strategy", "unknown strategy"),
        ({**SMALL, "rovers": 1, "strategy": "closest-frontier"}, "/strategy", "rovers"),
        ({**SMALL, "planner": "luck"}, "/planner", "unknown planner 'luck'; there are anytime, "),
        ({**SMALL, "planner": "cmd:luck"}, "/planner", "not a command line"),
        ({**SMALL, "budget": {"seconds": 1e5}}, "/budget/seconds", "at most"),
        ({**SMALL, "speed": 0}, "/speed", "must be positive, got 0"),
        ({**SMALL, "carriers": 0}, "/carriers", "must be 1 or more, got 0"),
        ({**SMALL, "seed": -1}, "/seed", "must be 0 or more, got -1"),
        ({**SMALL, "starts_m": [[1, 1], [2, 2]]}, "/starts_m", "has 2 points for 1 carriers"),
        ({**SMALL, "starts_m": [[99, 1]]}, "/starts_m/0", "outside the map"),
        ({**SMALL, "starts_m": [[0, 0]]}, "/starts_m/0", "the cell is obstacle"),
        ({**SMALL, "zones": [{**AWAY, "weight": 2}]}, "/zones/0/weight", ""),
        ({**SMALL, "zones": [{**AWAY, "kind": "nogo"}]}, "/zones/0/kind", "did you mean 'no_go'?"),
        ({**SMALL, "zones": [AWAY]}, "/zones/0/polygon_m", "no cell of the map"),
        ({**SMALL, "batteries": {"rover": {"charge_w": 1}}}, "/batteries/rover/capacity_j", ""),
        (
            {**SMALL, "batteries": {"rover": {"capacity_j": 0}}},
            "/batteries/rover/capacity_j",
            "must be positive, got 0",
        ),
        ({**SMALL, "batteries": {"truck": {"capacity_j": 1}}}, "/batteries/truck", ""),
        ({**SMALL, "chargers": [{"at_m": [0, 0]}]}, "/chargers/0/at_m", "is an obstacle"),
        ({**SMALL, "chargers": [{"at_m": [99, 0]}]}, "/chargers/0/at_m", "outside the map"),
        ({**SMALL, "chargers": [{}]}, "/chargers/0", "needs one of at_m, cell"),
        (on_map(YAML.replace("resolution", "resolutoin")), "/map/yaml", "resolution"),
        (on_map(YAML.replace("0.25\nor", "0.001\nor")), "/map/yaml", "too large"),
        (on_map(image="bm8="), "/map/image_base64", "not a PNG or PGM"),
        (on_map(image="####"), "/map/image_base64", "should match pattern"),
        (on_map(image=picture(free=0)), "/map", "no room"),
        (on_map(image=picture(free=0)), "/map", "there is no free cell"),
        (on_map(YAML.replace("negate: 0", "negate: 1")), "/map", "free space leaks to the border"),
        (on_map("format: marsupial-scenario\nversion: 1\n"), "/map/yaml", "this is a marsupial scenario"),
        ({"carriers": 1}, "/scenario", "must have one of the fields scenario, map"),
    ],
)
def test_errors_are_reported_by_the_field_that_caused_them(
    http: httpx.Client, body: dict[str, Any], pointer: str, said: str
) -> None:
    refused = problem(http.post("/v1/simulations", json=body), 422, "invalid")
    assert any(one["pointer"] == pointer and said in one["detail"] for one in refused["errors"]), refused["errors"]


BEYOND = (
    ({**SMALL, "carriers": 31}, "/carriers"),
    ({**SMALL, "scenario": "office"}, "/scenario"),
    (on_map(image=picture((101, 100))), "/map/image_base64"),
)


@pytest.mark.parametrize(("body", "pointer"), BEYOND)
def test_requests_beyond_the_limits_are_refused_at_once(http: httpx.Client, body: dict[str, Any], pointer: str) -> None:
    assert pointers(problem(http.post("/v1/simulations", json=body), 413, "too-large")) == [pointer]


def test_carriers_start_where_they_were_placed_and_stay_out_of_zones(http: httpx.Client) -> None:
    zone = {"name": "west", "kind": "no_go", "polygon_m": [[0, 0], [3, 0], [3, 7.5], [0, 7.5]]}
    body = on_map(carriers=2, starts_m=[[8.1, 4.1]], zones=[zone], speed=0.1)
    shown = http.post("/v1/simulations/preview", json=body).json()["robots"]
    assert shown[0]["point_m"] == [8.125, 4.125]
    assert all(one["point_m"][0] > 3 for one in shown)
    mission = http.post("/v1/simulations", json=body).json()
    assert http.get(f"/v1/missions/{mission['id']}/zones").json()["zones"][0]["name"] == "west"
    http.post(mission["links"]["cancel"])


def test_the_page_and_its_files_are_served_under_a_strict_policy(http: httpx.Client) -> None:
    page = http.get("/")
    assert page.headers["content-type"].startswith("text/html")
    assert re.search(r"script-src 'self' 'sha256-[\w+/=]+'; style-src 'self';", page.headers["content-security-policy"])
    assert "<style" not in page.text
    script = http.get("/page/live/live.js")
    assert script.headers["content-type"].startswith("text/javascript")
    again = http.get("/page/live/live.js", headers={"If-None-Match": script.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    plain = http.get("/page/live/live.js", headers={"Accept-Encoding": "identity"})
    assert (script.headers["content-encoding"], plain.headers.get("content-encoding")) == ("gzip", None)
    assert plain.content == script.content
    assert http.get("/page/page.css").headers["content-type"].startswith("text/css")
    problem(http.get("/page/log/../page.py"), 404, "not-found")


def test_the_map_of_a_job_is_available_if_it_was_sent_with_one(server: Server) -> None:
    with client(server) as http:
        for demo, status in (("yard", 200), ("tiny", 404)):
            job = http.post("/v1/jobs", json={**http.get(f"/v1/demo-data/{demo}").json(), "planner": "greedy"}).json()
            found = http.get(f"{job['links']['self']}/map")
            assert found.status_code == status
            if status == 200:
                told = found.json()
                assert (told["width"], told["height"], told["resolution_m"]) == (20, 11, 0.5)
                assert sum(told["runs"][1::3]) < 20 * 11, "what is unknown is in no run"


FAULTS = [
    {"fault": "slows", "robot": "carrier1", "at_s": 1.1, "speed_share": 0.5},
    {"fault": "stuck", "rate_per_h": 200, "for_s": 2},
    {"fault": "ground", "area_m": [9.0, 5.0, 10.0, 6.0], "terrain": "obstacle", "at_s": 5},
]


def test_a_simulation_with_faults_and_batteries_has_the_log_of_the_run(http: httpx.Client, tmp_path: Path) -> None:
    asked = {"scenario": "lobby", "planner": "greedy", "budget": {"steps": 1}, "coverage": 0.9, "seed": 3}
    batteries = {"carrier": {"capacity_j": 4000, "charge_w": 400}, "rover": {"capacity_j": 250.0, "charge_w": 60}}
    more = {"faults": FAULTS, "batteries": batteries, "chargers": [{"at_m": [2.0, 2.0]}]}
    mission = http.post("/v1/simulations", json=asked | more).json()
    scenario, notes = builtin_scenario("lobby"), Fields({"faults": FAULTS}, "", [])
    faults = read_faults(notes, [member.name for member in scenario.team], scenario.grid.terrains, scenario.grid)
    kinds = tuple(replace(kind, battery=Battery(**batteries[kind.role])) for kind in scenario.robot_types)
    grid = replace(scenario.grid, chargers=(scenario.grid.cell_at_m(2.0, 2.0),))
    limits = MissionLimits(coverage=0.9)
    scenario = replace(scenario, grid=grid, robot_types=kinds, faults=faults, limits=limits)
    explore(scenario, planner="greedy", steps=1, seed=3, log=tmp_path / "log.jsonl")
    wait_until(lambda: http.get(mission["links"]["self"]).json()["state"] == "ended")
    events = parse_log(http.get(mission["links"]["log"]).content).events
    assert any(isinstance(event, SpeedChanged) for event in events)
    charges = [share for event in events if isinstance(event, Planned) for _, share in event.charges]
    assert 0 < min(charges) < 0.8
    assert events == parse_log((tmp_path / "log.jsonl").read_bytes()).events


@pytest.mark.parametrize(
    ("fault", "pointer"),
    [
        ({"fault": "lost", "robot": "nobody", "at_s": 1}, "/faults/0/robot"),
        ({"fault": "flood", "robot": "carrier1", "at_s": 1}, "/faults/0/fault"),
        ({"fault": "lost", "robot": "carrier1", "at_s": 1.1, "colour": 3}, "/faults/0/colour"),
        (3, "/faults/0"),
        ({"fault": "stuck", "rate_per_h": 1000, "for_s": 1, "robot": 3}, "/faults/0/robot"),
    ],
)
def test_wrong_faults_of_a_simulation_are_named(http: httpx.Client, fault: object, pointer: str) -> None:
    refused = problem(http.post("/v1/simulations", json={**SMALL, "faults": [fault]}), 422, "invalid")
    assert pointers(refused) == [pointer]


def test_too_many_faults_of_a_simulation_are_refused(http: httpx.Client) -> None:
    many = [{"fault": "stuck", "rate_per_h": 1000, "for_s": 1, "seed": seed} for seed in range(30)]
    refused = problem(http.post("/v1/simulations", json={**SMALL, "faults": many}), 422, "invalid")
    assert pointers(refused) == ["/faults"]
    problem(http.post("/v1/simulations", json={**SMALL, "faults": many * 50}), 413, "too-large")
    problem(http.post("/v1/simulations", json={**SMALL, "faults": None}), 422, "invalid")
