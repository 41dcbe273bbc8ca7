from pathlib import Path

import httpx
import pytest
from service_requests import serve

import generate_api as generate
from marsupial.formats.loglines import EVENTS
from marsupial_service.app import create_app
from marsupial_service.http.openapi import stored_text
from marsupial_service.settings import ServiceSettings


def test_the_document_kept_is_the_one_served_where_keys_are_needed() -> None:
    assert generate.openapi_text() == stored_text(), "run `make generated`"


def test_without_keys_none_are_asked_for(http: httpx.Client) -> None:
    document = http.get("/openapi.json").json()
    assert "securitySchemes" not in document["components"]
    assert not any(
        "401" in operation["responses"] for path in document["paths"].values() for operation in path.values()
    )


def test_the_command_prints_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert serve(capsys, "--openapi")[:2] == (0, stored_text())


def test_every_error_of_every_route_is_a_problem(tmp_path: Path) -> None:
    document = create_app(ServiceSettings(data=tmp_path, keys=True)).openapi()
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            errors = {s: r for s, r in operation["responses"].items() if int(s) >= 400}
            assert {"406", "422", "500"} <= set(errors), (method, path)
            assert all(list(r["content"]) == ["application/problem+json"] for r in errors.values()), (method, path)


def test_the_document_lists_the_events(http: httpx.Client) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    found = {
        tag: {one["properties"]["event"]["const"] for one in schema["oneOf"]}
        for tag, path in (("jobs", "/v1/jobs/{job}/events"), ("missions", "/v1/missions/{mission}/events"))
        for schema in [paths[path]["get"]["responses"]["200"]["content"]["text/event-stream"]["itemSchema"]]
    }
    log = http.get("/openapi.json").json()["components"]["schemas"]["LogData"]["properties"]["event"]["enum"]
    assert set(log) == EVENTS.keys()
    assert found == {
        "jobs": {"state", "plan", "end"},
        "missions": {"state", "commands", "decision", "log", "frame", "quota", "end"},
    }
