"""Reports over HTTP: by robot, in batches, in growing frames; and the schemas of events."""

import json

import pytest
from jsonschema import Draft202012Validator
from mission_setup import team
from service_requests import pointers
from support.services.plain_client import frames
from support.services.servers import Server

from marsupial.formats.missionlog import parse_log
from marsupial.model.mission import MissionEnded
from marsupial_service.http.openapi import stored_text
from marsupial_service.schemas.enums import EventType

START = {"n": 1, "t_ms": 0}


def test_each_robot_counts_its_own_reports_beside_those_of_the_team(server: Server, mission: str) -> None:
    path = f"{mission}/reports"
    sent = ((1, "carrier1", 10), (1, "carrier2", 5), (2, "carrier1", 10), (1, None, 20), (2, "carrier2", 7))
    for n, robot, t_ms in sent:
        report = {"n": n, "t_ms": t_ms} | ({} if robot is None else {"robot": robot})
        for _ in range(2):
            status, _, taken = server.ask("POST", path, report)
            assert (status, taken) == (200, report | {"revision": 0})
    assert server.ask("GET", mission)[2]["n"] == 1
    assert server.ask("GET", mission)[2]["t_ms"] == 20
    for wrong, pointer in (
        ({"robot": "carrier1", "n": 4, "t_ms": 30}, "/n"),
        ({"robot": "carrier2", "n": 3, "t_ms": 6}, "/t_ms"),
        ({"robot": "carrier1", "n": 2, "t_ms": 11}, "/n"),
    ):
        status, _, problem = server.ask("POST", path, wrong)
        assert (status, pointers(problem)) == (409, [pointer])
    status, _, problem = server.ask("POST", path, {"robot": "nobody", "n": 1, "t_ms": 6})
    assert (status, pointers(problem)) == (422, ["/robot"])


def test_a_batch_is_accepted_as_a_whole_or_not_at_all_and_once(server: Server, mission: str) -> None:
    path = f"{mission}/reports"
    batch = [
        START,
        {"robot": "carrier1", "n": 1, "t_ms": 5},
        {"robot": "carrier1", "n": 2, "t_ms": 9},
        {"n": 2, "t_ms": 9},
    ]
    for wrong, refused, pointer in (
        ({"n": 4, "t_ms": 9}, 409, "/reports/4/n"),
        ({"n": 3, "t_ms": 9, "finished": [1]}, 409, "/reports/4/finished/0"),
        ({"n": 3, "t_ms": 9, "lost": [{"robot": "x"}]}, 422, "/reports/4/lost/0/robot"),
    ):
        status, _, problem = server.ask("POST", path, {"reports": [*batch, wrong]})
        assert (status, pointers(problem)) == (refused, [pointer])
        assert server.ask("GET", mission)[2]["n"] == 0
    for more in ([], [], [{"n": 3, "t_ms": 12}]):
        status, _, taken = server.ask("POST", path, {"reports": batch + more})
        assert (status, [one["n"] for one in taken["reports"]]) == (200, [1, 1, 2, 2, *(one["n"] for one in more)])
    assert server.ask("POST", path, batch[1])[0] == 200
    assert server.ask("GET", mission)[2]["n"] == 3
    wide = {"n": 9, "t_ms": 9, "frame": {"width": 2000, "height": 2000}, "map": {"runs": []}}
    status, _, problem = server.ask("POST", path, {"reports": [wide, wide]})
    assert (status, pointers(problem)) == (413, ["/reports"])
    assert server.ask("POST", path, {"reports": []})[0] == 422
    assert pointers(server.ask("POST", path, {})[2]) == ["/n"]


def test_the_frame_grows_with_reports_and_cells_refer_to_the_given_frame(server: Server, mission: str) -> None:
    path, first = f"{mission}/reports", server.ask("GET", f"{mission}/map")[2]
    edge = first["resolution_m"]
    here = {"width": 4, "height": 3, "origin_m": [-2 * edge, -1 * edge, 0]}
    seen = [{"robot": "carrier1", "runs": [0, 1, 0, 11, 1, 1]}]
    assert server.ask("POST", path, {**START, "frame": here, "revealed": seen})[0] == 200
    grown = server.ask("GET", f"{mission}/map")[2]
    assert (grown["width"], grown["height"]) == (first["width"] + 2, first["height"] + 1)
    assert grown["origin_m"] == pytest.approx([-2 * edge, -edge, 0])
    assert grown["runs"] == [0, 1, 0, 2 * grown["width"] + 3, 1, 1]
    later = {"n": 2, "t_ms": 1, "robots": [{"name": "carrier1", "cell": [grown["width"] - 1, 0]}]}
    assert server.ask("POST", path, later)[0] == 200
    for frame, pointer, status in (
        ({**here, "origin_m": [0, 0, 0.5]}, "/frame/origin_m", 422),
        ({**here, "resolution_m": 2 * edge}, "/frame/resolution_m", 422),
        ({**here, "width": 10**6, "height": 10**6}, "/frame", 422),
        ({**here, "origin_m": [10**6, 0, 0]}, "/frame", 409),
    ):
        found, _, problem = server.ask("POST", path, {"n": 3, "t_ms": 1, "frame": frame})
        assert (found, pointers(problem)) == (status, [pointer])
    assert server.ask("GET", f"{mission}/map")[2] == grown


def test_every_event_matches_its_schema(server: Server, mission: str) -> None:
    document = json.loads(stored_text())
    events = document["paths"]["/v1/missions/{mission}/events"]["get"]["responses"]["200"]
    variants = events["content"]["text/event-stream"]["itemSchema"]["oneOf"]
    data = {one["properties"]["event"]["const"]: one["properties"]["data"]["contentSchema"] for one in variants}
    assert set(data) == set(EventType)
    validators = {
        kind: Draft202012Validator({**schema, "components": document["components"]}) for kind, schema in data.items()
    }
    robots, lines = team(), []
    seen: set[str] = set()
    frame = server.ask("GET", f"{mission}/map")[2]
    for _, kind, text in frames(int(server.url.rpartition(":")[2]), f"{mission}/events"):
        validators[kind].validate(json.loads(text))
        seen.add(kind)
        if kind == "log":
            lines.append(text)
        report = robots.answer(json.loads(text)) if kind == "commands" else None
        if report is not None:
            if report["n"] == 9:
                server.ask("POST", f"{mission}/pause")
                server.ask("POST", f"{mission}/resume")
            if report["n"] == 30:
                told = {"width": frame["width"] + 1, "height": frame["height"], "origin_m": frame["origin_m"]}
                report = {"robot": "carrier1", "n": 1, "t_ms": report["t_ms"], "frame": told}
            server.ask("POST", f"{mission}/reports", report)
            if "frame" in report:
                server.ask("POST", f"{mission}/cancel")
    assert seen == set(EventType) - {EventType.QUOTA}  # only sent with keys
    assert isinstance(parse_log("".join(f"{line}\n" for line in lines).encode()).events[-1], MissionEnded)


def test_the_documentation_page_loads_nothing_from_other_hosts(server: Server) -> None:
    status, kind, page = server.ask("GET", "/docs")
    assert (status, kind.partition(";")[0]) == (200, "text/html")
    assert "<script" not in page
    assert "//" not in page.replace("https://www.rfc-editor.org", "")
    assert "`" not in page
    for name in ("CommandsData", "DriveCommand", "ReportBody"):
        assert f'<h3 id="{name}">' in page
