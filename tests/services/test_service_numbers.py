"""JSON has one kind of number: 1.0 is 1, wherever a whole number is asked."""

import json
import math
from typing import Any

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from service_requests import pointers, problem

from marsupial_service.examples.demos import EXAMPLES
from marsupial_service.intake.reading import parse

JSON = {"content-type": "application/json"}


def floats(value: Any) -> Any:
    """Return a document with every whole number written with a point."""
    if isinstance(value, dict):
        return {key: floats(one) for key, one in value.items()}
    if isinstance(value, list):
        return [floats(one) for one in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


@pytest.mark.parametrize("text", [b"1", b"1.0", b"1.000", b"1e0", b"10e-1", b"0.1E+1"])
def test_a_whole_number_is_one_however_it_is_written(text: bytes) -> None:
    value = parse(text)
    assert (value, type(value)) == (1, int)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_no_number_changes_its_value(number: float) -> None:
    value = parse(json.dumps(number).encode())
    assert value == number
    assert isinstance(value, int) == number.is_integer()


def test_a_number_beyond_all_numbers_is_infinite() -> None:
    assert parse(b"[1e999, -1e999]") == [math.inf, -math.inf]


def test_every_example_is_taken_with_points_in_its_numbers(http: httpx.Client) -> None:
    mission = http.post("/v1/missions", json=floats(EXAMPLES["/v1/missions"]())).json()
    for name, example in EXAMPLES.items():
        answer = http.post(name.replace("{mission}", mission["id"]), json=floats(example()))
        assert answer.status_code < 300, (name, answer.text)
    assert http.get(mission["links"]["self"]).json()["n"] == 1


@pytest.mark.parametrize("wrong", [1.5, 1e-9, True, "1", "1.0", 1e300])
@pytest.mark.parametrize(("path", "pointer"), [(("steps",), "/budget/steps"), (("travel_ms",), "/situation/travel_ms")])
def test_non_integers_are_refused_with_pointers(
    http: httpx.Client, wrong: object, path: tuple[str], pointer: str
) -> None:
    body = http.get("/v1/demo-data/tiny").json()
    if path == ("steps",):
        body["budget"] = {"steps": wrong}
    else:
        kind = sorted(body["situation"]["travel_ms"])[0]
        body["situation"]["travel_ms"][kind][0][1] = wrong
        pointer += f"/{kind}/0/1"
    assert pointers(problem(http.post("/v1/jobs", json=body), 422, "invalid")) == [pointer]


def test_with_a_key_a_request_is_the_same_with_points_in_its_numbers(http: httpx.Client) -> None:
    body = {**http.get("/v1/demo-data/yard").json(), "budget": {"seconds": 1}}
    for path, sent in (("/v1/jobs", body), ("/v1/missions", EXAMPLES["/v1/missions"]())):
        made = [
            http.post(path, content=json.dumps(one), headers={**JSON, "Idempotency-Key": "points"}).json()["id"]
            for one in (sent, floats(sent), sent)
        ]
        assert len(set(made)) == 1


def test_a_report_sent_again_is_the_same_with_points_in_its_numbers(http: httpx.Client) -> None:
    mission = http.post("/v1/missions", json=EXAMPLES["/v1/missions"]()).json()["links"]
    report = EXAMPLES["/v1/missions/{mission}/reports"]()
    answers = [http.post(mission["reports"], json=one) for one in (report, floats(report), report)]
    assert [answer.status_code for answer in answers] == [200, 200, 200]
    other = problem(http.post(mission["reports"], json={**report, "t_ms": report["t_ms"] + 1}), 409, "conflict")
    assert pointers(other) == ["/n"]


def test_the_situation_of_a_job_is_written_with_whole_numbers(http: httpx.Client) -> None:
    body = http.get("/v1/demo-data/tiny").json()
    job = http.post("/v1/jobs", json={**body, "situation": floats(body["situation"])}).json()
    assert http.get(job["links"]["situation"]).json()["situation"] == body["situation"]
    assert ".0" not in json.dumps(http.get(job["links"]["situation"]).json()["situation"]["travel_ms"])
