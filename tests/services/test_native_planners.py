"""Planners in separate processes, in jobs and in missions: they answer, and leave no process behind."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import httpx
import psutil
import pytest
from service_requests import client as client_of
from support.missions.small_missions import Recorder
from support.processes.process_tree import below_launcher_of
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.errors import UsageError
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.situations import situation_of
from marsupial.model import Budget, Outcome, Status
from marsupial.planning.checker import check
from marsupial.planning.engines import engine
from marsupial_client import Client
from marsupial_service.analyses.situations import parsed_plan
from marsupial_service.schemas.requests import ActionsPlan
from marsupial_service.simulation import simulate_mission

ANSWERS = (Outcome.OPTIMAL, Outcome.SATISFICING, Outcome.TIMEOUT, Outcome.NO_PLAN)


@pytest.fixture(params=["tamer", "aries"])
def planner(request: pytest.FixtureRequest) -> str:
    missing = engine(request.param).info.missing
    if missing is not None:
        pytest.skip(f"{request.param}: {missing}")
    return str(request.param)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with Server(tmp_path_factory.mktemp("service")) as found:
        found.wait_ready()
        yield found


@pytest.fixture
def http(running: Server) -> Iterator[httpx.Client]:
    with client_of(running) as found:
        yield found


@contextmanager
def leaving_nothing(server: Server) -> Iterator[set[psutil.Process]]:
    """Yield the set of processes below a service during the block; check that all have ended after it."""
    seen: set[psutil.Process] = set()
    service = psutil.Process(server.process.pid)
    over = threading.Event()

    def watch() -> None:
        while not over.wait(0.05):
            seen.update(below_launcher_of(service))

    watching = threading.Thread(target=watch)
    watching.start()
    try:
        yield seen
    finally:
        over.set()
        watching.join()
    assert seen
    assert not psutil.wait_procs(list(seen), HANG_S)[1]


def explore(client: Client, planner: str, observer: Recorder, cancelled: Callable[[], bool]) -> Status:
    return simulate_mission(
        client,
        builtin_scenario("lobby"),
        strategy="temporal",
        planner=planner,
        budget=Budget(seconds=0.4),
        seed=1,
        observer=observer,
        stopping=lambda: nullcontext(cancelled),
    ).status


def test_a_job_is_given_a_valid_plan(running: Server, http: httpx.Client, planner: str) -> None:
    body = {**http.get("/v1/demo-data/yard").json(), "planner": planner, "budget": {"seconds": 60}}
    with leaving_nothing(running):
        links = http.post("/v1/jobs", json=body).json()["links"]
        with http.stream("GET", links["events"]) as answer:
            assert any(line == "event: plan" for line in answer.iter_lines())
        job = http.post(links["cancel"]).json()
    assert (job["state"] in ("succeeded", "cancelled"), job["planner"]) == (True, planner)
    situation = situation_of(http.get(job["links"]["situation"]).json()["situation"])
    plan = parsed_plan(ActionsPlan.model_validate({"actions": job["best"]["actions"]}), situation).plan
    assert check(situation, plan).valid


def test_a_mission_is_planned_with_it(running: Server, planner: str) -> None:
    told = Recorder()
    with leaving_nothing(running):
        client = Client(running.url, patience_s=HANG_S)
        assert explore(client, planner, told, lambda: len(told.reports) >= 2) is Status.CANCELLED
    assert {report.planner for report in told.reports} == {planner}
    assert all(report.outcome in ANSWERS and not report.refused for report in told.reports), told.reports


@pytest.mark.slow
def test_nothing_of_a_mission_outlives_a_server_that_is_killed(tmp_path: Path, planner: str) -> None:
    told = Recorder()
    with Server(tmp_path) as server, leaving_nothing(server) as seen:
        client = Client(server.url, patience_s=HANG_S)

        def kill() -> bool:
            if told.reports and seen:
                server.process.kill()
                client._session.service.patience_s = 0.1
            return False

        with pytest.raises(UsageError, match="can't be reached"):
            explore(client, planner, told, kill)
