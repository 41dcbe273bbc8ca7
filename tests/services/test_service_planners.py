"""Planners that the operator offers by name: they are listed and usable, and others are refused."""

import json
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from service_requests import client, pointers, problem, serve
from support.planning.situations import one_hall
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.formats.situation import situation_to_json
from marsupial_service.examples.demos import EXAMPLES

SCRIPT = """
import sys
domain, problem = (open(path).read() for path in sys.argv[1:])
assert "(define (domain" in domain and "(define (problem" in problem
print("0.000: (explore c1 carrier_type c1_start t1)  [10.000]")
print("10.001: (explore c1 carrier_type t1 t2)  [20.000]", flush=True)
"""
"""Knows one plan, for `one_hall`."""

COMMAND = f"{shlex.quote(sys.executable)} -SE {{script}} {{{{domain}}}} {{{{problem}}}}"


@pytest.fixture(scope="module")
def command(tmp_path_factory: pytest.TempPathFactory) -> str:
    script = tmp_path_factory.mktemp("planner") / "planner.py"
    script.write_text(SCRIPT)
    return COMMAND.format(script=shlex.quote(str(script)))


@pytest.fixture(scope="module")
def offering(tmp_path_factory: pytest.TempPathFactory, command: str) -> Iterator[Server]:
    planners = (f"--planner=scripted={command}", "--planner=gone=./nowhere {domain} {problem}")
    with Server(tmp_path_factory.mktemp("service"), *planners) as found:
        yield found


@pytest.fixture
def asked(offering: Server) -> Iterator[httpx.Client]:
    with client(offering) as found:
        yield found


def job(planner: str, **budget: float) -> dict[str, Any]:
    situation = json.loads(situation_to_json(one_hall()))
    return {"planner": planner, "budget": budget or {"seconds": 20}, "situation": situation}


def test_it_is_listed_with_what_it_can_do(asked: httpx.Client) -> None:
    listed = {planner["name"]: planner for planner in asked.get("/v1/planners").json()["planners"]}
    assert {"auto", "greedy", "scripted", "gone"} <= set(listed)
    scripted = listed["scripted"]
    assert (scripted["available"], scripted["missing"], scripted["deterministic_steps"]) == (True, None, False)
    assert (listed["gone"]["available"], "nowhere" in listed["gone"]["missing"]) == (False, True)


def test_it_solves_a_job(asked: httpx.Client) -> None:
    done = asked.post("/v1/jobs", json=job("scripted"), headers={"Prefer": f"wait={HANG_S:g}"}).json()
    assert (done["state"], done["outcome"], done["planner"]) == ("succeeded", "satisficing", "scripted")
    assert [(action["name"], action["place"]) for action in done["best"]["actions"]] == [
        ("explore", "t1"),
        ("explore", "t2"),
    ]


def test_its_invalid_plans_are_not_reported(asked: httpx.Client) -> None:
    body = {**asked.get("/v1/demo-data/tiny").json(), "planner": "scripted"}
    done = asked.post("/v1/jobs", json=body, headers={"Prefer": f"wait={HANG_S:g}"}).json()
    assert (done["state"], done["best"]) == ("failed", None)


def test_a_mission_uses_it_and_never_shows_the_command(asked: httpx.Client) -> None:
    body = {**EXAMPLES["/v1/missions"](), "planner": "scripted", "budget": {"seconds": 1}}
    links = asked.post("/v1/missions", json=body).json()["links"]
    asked.post(links["reports"], json=EXAMPLES["/v1/missions/{mission}/reports"]())
    lines = []
    with asked.stream("GET", links["events"]) as answer:
        for line in answer.iter_lines():
            lines.append(line)
            if lines[-2:-1] == ["event: decision"]:
                break
    asked.post(links["cancel"])
    decision = json.loads(lines[-1].removeprefix("data: "))
    assert decision["planner"] == "scripted"
    assert "planner.py" not in asked.get(links["events"]).text


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        (job("nobody"), "/planner"),
        (job("gone"), "/planner"),
        (job("cmd:sh {domain} {problem}"), "/planner"),
        (job("scripted", steps=3), "/budget/steps"),
    ],
)
def test_a_job_for_what_is_not_offered_is_refused(asked: httpx.Client, body: dict[str, Any], pointer: str) -> None:
    assert pointers(problem(asked.post("/v1/jobs", json=body), 422, "invalid")) == [pointer]


@pytest.mark.parametrize(("planner", "budget"), [("nobody", "seconds"), ("gone", "seconds"), ("scripted", "steps")])
def test_a_mission_for_what_is_not_offered_is_refused(asked: httpx.Client, planner: str, budget: str) -> None:
    body = {**EXAMPLES["/v1/missions"](), "planner": planner, "budget": {budget: 1}}
    document = problem(asked.post("/v1/missions", json=body), 422, "invalid")
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
