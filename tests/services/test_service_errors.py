import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from service_requests import pointers, problem

from marsupial import errors
from marsupial.errors import MarsupialError
from marsupial_service.app import create_app
from marsupial_service.examples.demos import DEMOS
from marsupial_service.intake.jobs import ANALYSIS_READER, JOB_READER
from marsupial_service.intake.missions import REPORT_READER
from marsupial_service.intake.reading import BodyReader, read_in_process
from marsupial_service.problems import ERROR_KINDS, KINDS, HttpProblem
from marsupial_service.settings import ServiceLimits, ServiceSettings

JSON = {"content-type": "application/json"}
situation = DEMOS["tiny"].load


def test_every_exception_of_the_library_has_a_kind() -> None:
    leaves = [cls for cls in vars(errors).values() if isinstance(cls, type) and issubclass(cls, MarsupialError)]
    assert set(ERROR_KINDS) == set(leaves) - {MarsupialError}
    assert set(ERROR_KINDS.values()) <= set(KINDS)


@pytest.mark.parametrize(
    ("method", "path", "status", "kind"),
    [
        ("GET", "/v1/jobs/none", 404, "not-found"),
        ("GET", "/v1/jobs/", 404, "not-found"),
        ("GET", "/v1/jobs/none/events", 404, "not-found"),
        ("POST", "/v1/jobs/none/cancel", 404, "not-found"),
        ("GET", "/v1/demo-data/none", 404, "not-found"),
        ("GET", "/v1/missions/none", 404, "not-found"),
        ("GET", "/v1/missions/none/events", 404, "not-found"),
        ("GET", "/v1/missions/none/log", 404, "not-found"),
        ("GET", "/v1/missions/none/map", 404, "not-found"),
        ("PUT", "/v1/jobs", 405, "no-method"),
        ("POST", "/v1/limits", 405, "no-method"),
        ("GET", "/v1/jobs?limit=0", 422, "invalid"),
        ("GET", "/v1/jobs?limit=1&limit=2", 422, "invalid"),
        ("GET", "/v1/jobs?state=lost", 422, "invalid"),
        ("GET", "/healthz?verbose=1", 422, "invalid"),
    ],
)
def test_every_error_is_a_problem(http: httpx.Client, method: str, path: str, status: int, kind: str) -> None:
    document = problem(http.request(method, path), status, kind)
    assert document["instance"] == path.partition("?")[0]


ELSEWHERE = ("https://pages.example", "http://localhost:1", "null", "http://localhost.pages.example", "")


def test_pages_of_another_origin_change_nothing(http: httpx.Client) -> None:
    for origin in ELSEWHERE:
        for method in ("POST", "PUT", "PATCH", "DELETE", "post"):
            refused = http.request(method, "/v1/missions/none/cancel", headers={"origin": origin})
            problem(refused, 403, "cross-origin")
        assert http.get("/v1/limits", headers={"origin": origin}).status_code == 200
    for site in ("cross-site", "same-site"):
        answer = http.post("/v1/missions/none/cancel", headers={"sec-fetch-site": site})
        problem(answer, 403, "cross-origin")
        assert http.get("/v1/limits", headers={"sec-fetch-site": site}).status_code == 200
    own = str(http.base_url).rstrip("/")
    page = {"origin": own, "sec-fetch-site": "same-origin"}
    problem(http.post("/v1/missions/none/cancel", headers=page), 404, "not-found")
    problem(http.post("/v1/missions/none/cancel", headers={"origin": own}), 404, "not-found")
    problem(http.post("/v1/missions/none/cancel"), 404, "not-found")


FAKES = ("[::1].pages.example", "localhost:pages.example", "[::1]:80.example", "localhost.", "[localhost]")


def test_a_service_without_keys_answers_to_local_host_names_only(http: httpx.Client) -> None:
    for host in ("pages.example", "pages.example:8080", "127.0.0.1.pages.example", "[::2]:8080", "", *FAKES):
        problem(http.get("/v1/limits", headers={"host": host}), 421, "misdirected")
    for host in ("localhost", "LOCALHOST:8080", "[::1]:8080", "127.0.0.1"):
        assert http.get("/v1/limits", headers={"host": host}).status_code == 200


def test_a_wrong_method_is_answered_with_the_allowed_ones(http: httpx.Client) -> None:
    assert http.put("/v1/jobs").headers["allow"] == "GET, HEAD, POST"
    assert http.delete("/v1/jobs/x").headers["allow"] == "GET, HEAD"
    assert (http.head("/v1/analysis").status_code, http.head("/v1/analysis").headers["allow"]) == (405, "POST")


def test_an_answer_in_another_form_is_refused(http: httpx.Client) -> None:
    problem(http.get("/v1/limits", headers={"accept": "text/html"}), 406, "not-acceptable")
    problem(http.get("/v1/limits", headers={"accept": "application/json;q=0"}), 406, "not-acceptable")
    assert http.get("/v1/limits", headers={"accept": "text/html, application/*;q=0.1"}).status_code == 200


def test_another_body_than_json_is_refused(http: httpx.Client) -> None:
    for headers in ({}, {"content-type": "text/plain"}, {**JSON, "content-encoding": "gzip"}):
        problem(http.post("/v1/jobs", content=b"{}", headers=headers), 415, "media-type")


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b'{"a": NaN}',
        b'{"a": Infinity}',
        b'{"planner": "a", "planner": "b"}',
        b'{"situation": {"types": [], "types": []}}',
        b'{"a": "\\ud800"}',
        b'{"\\ud800": 1}',
        b"\xff",
        b"\xef\xbb\xbf{}",
        b"[" * 100_000,
        b"1" * 5000,
    ],
)
def test_invalid_json_is_refused(http: httpx.Client, body: bytes) -> None:
    problem(http.post("/v1/jobs", content=body, headers=JSON), 400, "bad-json")


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"planner": 1}, "/planner"),
        ({"planner": "none"}, "/planner"),
        ({"planner": "cmd:sh {domain} {problem}"}, "/planner"),
        ({"extra": 1}, "/extra"),
        ({"budget": {}}, "/budget/seconds"),
        ({"budget": {"seconds": 0}}, "/budget/seconds"),
        ({"budget": {"seconds": "1"}}, "/budget/seconds"),
        ({"budget": {"seconds": True}}, "/budget/seconds"),
        ({"budget": {"seconds": 10**400}}, "/budget/seconds"),
        ({"budget": {"seconds": 1e999}}, "/budget/seconds"),
        ({"budget": {"seconds": 1000}}, "/budget/seconds"),
        ({"budget": {"seconds": 1, "steps": 1}}, "/budget/steps"),
        ({"budget": None}, "/budget"),
        ({"planner": "tamer", "budget": {"steps": 1}}, "/budget/steps"),
        ({"map_state": {}}, "/map_state"),
    ],
)
def test_a_wrong_field_is_pointed_at(http: httpx.Client, change: dict[str, Any], pointer: str) -> None:
    body = json.dumps({"situation": situation(), **change}).replace("Infinity", "1e999")
    assert pointers(problem(http.post("/v1/jobs", content=body, headers=JSON), 422, "invalid")) == [pointer]


@pytest.mark.parametrize(
    ("path", "value", "pointer"),
    [
        (("robots", 1, "type"), "robot", "/situation/robots/1/type"),
        (("robots", 0, "carrier"), "c", "/situation/robots/0"),
        (("travel_ms", "rover", 0, 1), -5, "/situation/travel_ms/rover/0/1"),
        (("travel_ms", "a/b~c"), [], "/situation/travel_ms/a~1b~0c"),
    ],
)
def test_errors_in_a_situation_have_pointers(
    http: httpx.Client, path: tuple[str | int, ...], value: Any, pointer: str
) -> None:
    sent: Any = situation()
    part = sent
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    document = problem(http.post("/v1/jobs", json={"situation": sent}), 422, "invalid")
    assert pointers(document)[0] == pointer


def test_a_body_beyond_the_limit_is_refused_however_it_comes(http: httpx.Client) -> None:
    def chunks() -> Iterator[bytes]:
        for _ in range(30):
            yield b" " * 10_000

    problem(http.post("/v1/jobs", content=b" " * 200_001, headers=JSON), 413, "too-large")
    problem(http.post("/v1/jobs", content=chunks(), headers=JSON), 413, "too-large")
    problem(http.post("/v1/jobs", content=b" " * 200_000, headers=JSON), 400, "bad-json")


def test_too_many_robots_are_pointed_at(http: httpx.Client) -> None:
    sent = situation()
    sent["robots"] *= 16
    assert pointers(problem(http.post("/v1/jobs", json={"situation": sent}), 413, "too-large")) == ["/situation/robots"]


def test_limits_are_shown_with_what_they_mean(http: httpx.Client) -> None:
    limits = http.get("/v1/limits").json()["limits"]
    assert isinstance(limits["slots"]["value"], int)
    assert limits["body_bytes"] == {"value": 200_000, "meaning": "bytes of a request body"}
    assert set(limits) == set(ServiceLimits.__dataclass_fields__)


@pytest.mark.parametrize(
    ("reader", "body", "pointer", "detail"),
    [
        (JOB_READER, {"map_stat": {}, "situation": {}}, "/map_stat", "unknown field"),
        (JOB_READER, {"situation": {}, "planer": "auto"}, "/planer", "unknown field, did you mean 'planner'?"),
        (
            ANALYSIS_READER,
            {"map_state": {"map": {"rows": ["."], "resolution": 1}}},
            "/map_state/map/resolution",
            "unknown field, did you mean 'resolution_m'?",
        ),
        (
            REPORT_READER,
            {"reports": [{"n": 1, "t_ms": 0, "robots": [{"name": "a", "posem": [0, 0]}]}]},
            "/reports/0/robots/0/posem",
            "unknown field, did you mean 'pose_m'?",
        ),
        (ANALYSIS_READER, {"map_state": {"robots": 3}}, "/map_state/robots", "must be a list, got 3"),
        (ANALYSIS_READER, {}, "/map_state", "missing"),
        (JOB_READER, {"situation": {}, "map_state": {}}, "/map_state", "must not be given beside the other fields"),
        (JOB_READER, {"situation": {}, "budget": {"second": 1}}, "/budget/seconds", "must have one of the fields"),
    ],
)
def test_a_misspelt_field_is_answered_with_the_name_that_was_meant(
    reader: BodyReader[Any, Any], body: dict[str, Any], pointer: str, detail: str
) -> None:
    with pytest.raises(HttpProblem) as refusal:
        read_in_process((json.dumps(body).encode(), reader, ServiceLimits(), ()))
    found = {error.pointer: error.detail for error in refusal.value.errors}
    assert found[pointer].startswith(detail)


async def test_a_bug_is_answered_without_its_traceback(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    app = create_app(ServiceSettings(data=tmp_path))

    @app.get("/broken")
    async def broken() -> None:
        raise ZeroDivisionError("secret")

    async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as http:
        answer = await http.get("/broken")
    document = problem(answer, 500, "internal")
    assert "secret" not in answer.text
    assert document["detail"].endswith(answer.headers["x-request-id"])
    assert "secret" in caplog.text
