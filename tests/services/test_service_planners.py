"""Planners that the operator offers by name: they are listed and usable, and others are refused."""

import json
from pathlib import Path
from typing import Any

import httpx
import pytest
from service_requests import pointers, problem, serve
from support.planning.situations import one_hall
from support.waiting import HANG_S

from marsupial.formats.situation import situation_to_json
from marsupial_service.examples.demos import EXAMPLES


def job(planner: str, **budget: float) -> dict[str, Any]:
    situation = json.loads(situation_to_json(one_hall()))
    return {"planner": planner, "budget": budget or {"seconds": 20}, "situation": situation}


def test_it_is_listed_with_what_it_can_do(http: httpx.Client) -> None:
    listed = {planner["name"]: planner for planner in http.get("/v1/planners").json()["planners"]}
    assert {"auto", "greedy", "scripted", "gone"} <= set(listed)
    scripted = listed["scripted"]
    assert (scripted["available"], scripted["missing"], scripted["deterministic_steps"]) == (True, None, False)
    assert (listed["gone"]["available"], "nowhere" in listed["gone"]["missing"]) == (False, True)


def test_it_solves_a_job(http: httpx.Client) -> None:
    done = http.post("/v1/jobs", json=job("scripted"), headers={"Prefer": f"wait={HANG_S:g}"}).json()
    assert (done["state"], done["outcome"], done["planner"]) == ("succeeded", "satisficing", "scripted")
    assert [(action["name"], action["place"]) for action in done["best"]["actions"]] == [
        ("explore", "t1"),
        ("explore", "t2"),
    ]


def test_its_invalid_plans_are_not_reported(http: httpx.Client) -> None:
    body = {**http.get("/v1/demo-data/tiny").json(), "planner": "scripted"}
    done = http.post("/v1/jobs", json=body, headers={"Prefer": f"wait={HANG_S:g}"}).json()
    assert (done["state"], done["best"]) == ("failed", None)


def test_a_mission_uses_it_and_never_shows_the_command(http: httpx.Client) -> None:
    body = {**EXAMPLES["/v1/missions"](), "planner": "scripted", "budget": {"seconds": 1}}
    links = http.post("/v1/missions", json=body).json()["links"]
    http.post(links["reports"], json=EXAMPLES["/v1/missions/{mission}/reports"]())
    lines = []
    with http.stream("GET", links["events"]) as answer:
        for line in answer.iter_lines():
            lines.append(line)
            if lines[-2:-1] == ["event: decision"]:
                break
    http.post(links["cancel"])
    decision = json.loads(lines[-1].removeprefix("data: "))
    assert decision["planner"] == "scripted"
    assert "planner.py" not in http.get(links["events"]).text


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        (job("nobody"), "/planner"),
        (job("gone"), "/planner"),
        (job("cmd:sh {domain} {problem}"), "/planner"),
        (job("scripted", steps=3), "/budget/steps"),
    ],
)
def test_a_job_for_what_is_not_offered_is_refused(http: httpx.Client, body: dict[str, Any], pointer: str) -> None:
    assert pointers(problem(http.post("/v1/jobs", json=body), 422, "invalid")) == [pointer]


@pytest.mark.parametrize(("planner", "budget"), [("nobody", "seconds"), ("gone", "seconds"), ("scripted", "steps")])
def test_a_mission_for_what_is_not_offered_is_refused(http: httpx.Client, planner: str, budget: str) -> None:
    body = {**EXAMPLES["/v1/missions"](), "planner": planner, "budget": {budget: 1}}
    document = problem(http.post("/v1/missions", json=body), 422, "invalid")
    assert pointers(document) == ["/planner"]
    assert "cmd:" not in document["detail"].replace("'cmd:<command>", "")


@pytest.mark.parametrize(
    ("planner", "text"),
    [("greedy=plan {domain} {problem}", "'greedy' is the name"), ("mine=plan {domain}", "{problem} is missing")],
)
def test_an_invalid_planner_option_is_refused_at_the_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], planner: str, text: str
) -> None:
    code, _, error = serve(capsys, "--port", "0", "--data", str(tmp_path), "--planner", planner)
    assert (code, text in error) == (2, True), error
