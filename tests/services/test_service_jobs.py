import json
import re
from typing import Any

import httpx
import pytest
from service_requests import pointers, problem
from support.planning.situations import job_source, seat_taken
from support.services.plain_client import frames
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.library.situations import situation_of
from marsupial.planning.checker import check
from marsupial_service.analyses.situations import parsed_plan
from marsupial_service.schemas import answers
from marsupial_service.schemas.requests import ActionsPlan, TextPlan

WAIT = {"Prefer": f"wait={HANG_S:g}"}


@pytest.fixture
def tiny(http: httpx.Client) -> dict[str, Any]:
    found: dict[str, Any] = http.get("/v1/demo-data/tiny").json()
    return found


@pytest.fixture
def long(http: httpx.Client) -> dict[str, Any]:
    """A job that improves its plan for a long time."""
    found: dict[str, Any] = http.get("/v1/demo-data/office-6x3").json()
    return {**found, "planner": "anytime", "budget": {"seconds": 60}}


def test_a_job_is_stored_before_it_is_acknowledged(http: httpx.Client, tiny: dict[str, Any]) -> None:
    answer = http.post("/v1/jobs", json=tiny)
    assert answer.status_code == 202
    job = answers.JobAnswer.model_validate(answer.json())
    assert answer.headers["location"] == job.links.self == f"/v1/jobs/{job.id}"
    assert http.get(job.links.self).json()["id"] == job.id


@pytest.mark.parametrize("demo", ["tiny", "yard", "office-2x2"])
def test_demo_data_are_planned_for(http: httpx.Client, demo: str) -> None:
    answer = http.post("/v1/jobs", json=http.get(f"/v1/demo-data/{demo}").json(), headers=WAIT)
    assert (answer.status_code, answer.headers["preference-applied"]) == (200, f"wait={HANG_S:g}")
    job = answer.json()
    assert (job["state"], job["outcome"] in ("optimal", "satisficing")) == ("succeeded", True)
    found = http.get(job["links"]["situation"]).json()
    situation = situation_of(found["situation"])
    plan = parsed_plan(ActionsPlan.model_validate({"actions": job["best"]["actions"]}), situation).plan
    assert check(situation, plan).valid
    assert parsed_plan(TextPlan(ipc=job["best"]["ipc"]), situation).plan == plan
    assert (found["places"] is not None) == (demo == "yard")
    if demo == "yard":
        assert set(situation.places) == set(found["places"])
        assert found["places"]["s_mother"]["carrier"] == {"cell": [3, 2], "point_m": [11.75, 6.25]}


def test_a_situation_with_seats_is_planned_for_and_its_plans_are_checked(http: httpx.Client) -> None:
    source = job_source(seat_taken())
    job = http.post("/v1/jobs", json={**source, "planner": "exact", "budget": {"steps": 20}}, headers=WAIT).json()
    assert job["outcome"] == "optimal"
    answer = http.post("/v1/validations", json={**source, "plan": {"ipc": job["best"]["ipc"]}})
    assert answer.json()["valid"]
    swapped = [action for action in job["best"]["actions"] if action["name"] != "undock" or action["robot"] != "s1"]
    answer = http.post("/v1/validations", json={**source, "plan": {"actions": swapped}})
    assert answer.json()["violation"]["kind"] == "no_seat"
    types = source["situation"]["types"]
    types[0]["seats"] = {"climber": 1}
    assert pointers(problem(http.post("/v1/jobs", json=source), 422, "invalid")) == ["/situation/robots/0"]


def test_a_resumed_stream_is_the_rest_of_an_uninterrupted_one(http: httpx.Client, server: Server) -> None:
    body = {**http.get("/v1/demo-data/office-2x2").json(), "planner": "anytime", "budget": {"seconds": 0.5}}
    path = http.post("/v1/jobs", json=body).json()["links"]["events"]
    with http.stream("GET", path) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        assert answer.headers["x-accel-buffering"] == "no"
    whole = list(frames(server.port, path))
    kinds = [frame.type for frame in whole]
    assert kinds[-1] == "end"
    assert "plan" in kinds
    for frame in whole:
        json.loads(frame.data)
    for seen in range(len(whole)):
        resumed = list(frames(server.port, path, after=seen))
        assert resumed == whole[seen:]
        assert resumed[0].id == seen + 1


def test_a_job_that_is_cancelled_keeps_its_best_plan(http: httpx.Client, long: dict[str, Any]) -> None:
    links = http.post("/v1/jobs", json=long).json()["links"]
    with http.stream("GET", links["events"]) as answer:
        for line in answer.iter_lines():
            if line == "event: plan":
                break
    ended = http.post(links["cancel"])
    assert (ended.status_code, ended.json()["state"]) == (200, "cancelled")
    assert ended.json()["best"]["actions"]
    assert http.post(links["cancel"]).json() == ended.json()
    assert http.get(links["events"]).text.rstrip().splitlines()[-2] == "event: end"


def test_an_idempotency_key_makes_one_job(http: httpx.Client, tiny: dict[str, Any]) -> None:
    first = http.post("/v1/jobs", json=tiny, headers={"Idempotency-Key": "once"})
    again = http.post("/v1/jobs", json=tiny, headers={"Idempotency-Key": "once"})
    assert again.json()["id"] == first.json()["id"]
    assert (first.headers.get("idempotency-replayed"), again.headers["idempotency-replayed"]) == (None, "true")
    other = {**tiny, "planner": "greedy"}
    problem(http.post("/v1/jobs", json=other, headers={"Idempotency-Key": "once"}), 422, "key-reused")
    problem(http.post("/v1/jobs", json=tiny, headers={"Idempotency-Key": "a b"}), 422, "invalid")


def test_jobs_are_listed_page_by_page(http: httpx.Client, tiny: dict[str, Any]) -> None:
    made = [http.post("/v1/jobs", json=tiny, headers=WAIT).json()["id"] for _ in range(3)]
    page = http.get("/v1/jobs?limit=2&state=succeeded").json()
    assert [job["id"] for job in page["jobs"]] == made[:0:-1]
    assert http.get(page["next"]).json()["jobs"][0]["id"] == made[0]


def test_streams_are_limited(http: httpx.Client, long: dict[str, Any]) -> None:
    links = http.post("/v1/jobs", json=long).json()["links"]
    open_ones = [http.stream("GET", links["events"]) for _ in range(3)]
    for one in open_ones:
        one.__enter__()
    problem(http.get(links["events"]), 429, "too-many")
    for one in open_ones:
        one.__exit__(None, None, None)
    http.post(links["cancel"])
    assert http.get(links["self"]).json()["state"] == "cancelled"


def test_a_plan_can_be_validated(http: httpx.Client, tiny: dict[str, Any]) -> None:
    situation = tiny["situation"]
    best = http.post("/v1/jobs", json=tiny, headers=WAIT).json()["best"]
    for plan in ({"actions": best["actions"]}, {"ipc": best["ipc"]}):
        verdict = http.post("/v1/validations", json={"situation": situation, "plan": plan}).json()
        assert (verdict["valid"], verdict["makespan_ms"]) == (True, best["makespan_ms"])
        assert verdict["retimed"] == 0
    rounded = re.sub(r"\[(\d+\.\d\d)\d\]", r"[\1]", best["ipc"]).replace(".001:", ".00:").replace(".002:", ".00:")
    verdict = http.post("/v1/validations", json={"situation": situation, "plan": {"ipc": rounded}}).json()
    assert (verdict["valid"], verdict["retimed"]) == (True, 2)
    late = [{**best["actions"][0], "start_ms": -1}, *best["actions"][1:]]
    verdict = http.post("/v1/validations", json={"situation": situation, "plan": {"actions": late}}).json()
    assert (verdict["valid"], verdict["violation"]["kind"], verdict["violation"]["time_ms"]) == (False, "too_early", -1)
    none = http.post("/v1/validations", json={"situation": situation, "plan": {"actions": []}}).json()
    assert (none["violation"]["kind"], none["violation"]["action"]) == ("target_unexplored", None)
    wrong = http.post("/v1/validations", json={"situation": situation, "plan": {"ipc": "nonsense"}})
    assert pointers(problem(wrong, 422, "invalid")) == ["/plan/ipc"]


def test_answers_match_the_openapi_document(http: httpx.Client, tiny: dict[str, Any]) -> None:
    answers.PlannersAnswer.model_validate(http.get("/v1/planners").json())
    answers.DemoListAnswer.model_validate(http.get("/v1/demo-data").json())
    answers.LimitListAnswer.model_validate(http.get("/v1/limits").json())
    answers.HealthAnswer.model_validate(http.get("/healthz").json())
    answers.ReadyAnswer.model_validate(http.get("/readyz").json())
    answers.JobListAnswer.model_validate(http.get("/v1/jobs").json())
    http.post("/v1/jobs", json=tiny, headers=WAIT)
    metrics = http.get("/metrics", headers={"accept": "text/plain"}).text
    assert re.search(r'^marsupial_jobs\{state="succeeded"\} [1-9]', metrics, re.MULTILINE)
    assert 'marsupial_requests_total{method="POST",route="/v1/jobs"' in metrics
