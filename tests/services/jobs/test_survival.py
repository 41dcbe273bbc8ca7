import asyncio
import json
import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from job_setup import SLOW, ended, events_of, open_jobs, planned, plans_of, request, start_waiting_job, submit
from misbehaving_tasks import Dies, Escapes, pid_in
from support.planning.situations import one_room
from support.processes.process_tree import below_launcher, is_alive, no_job_runs
from support.waiting import wait_until

from benchmarks.trial import failpoints
from marsupial.planning.checker import check
from marsupial.processes import launcher as processes
from marsupial_service.schemas.enums import JobEventType, JobOutcome, JobState

pytestmark = pytest.mark.usefixtures("nothing_left")

MARK = "MARSUPIAL_TEST_MARK"


class JobServer:
    """The process of `job_server.py`, and everything it starts."""

    def __init__(self, folder: Path, what: str, armed: str = "") -> None:
        self._mark = uuid.uuid4().hex
        here = Path(__file__).parent
        self._process = subprocess.Popen(
            [sys.executable, str(here / "job_server.py"), str(folder), what, str(here), *sys.path],
            env={**os.environ, MARK: self._mark, failpoints.VARIABLE: armed},
            stdout=subprocess.PIPE,
            text=True,
        )

    def acknowledged(self, count: int) -> list[str]:
        """Wait for that many ids, or the end."""
        assert self._process.stdout is not None
        return [line.strip() for _, line in zip(range(count), self._process.stdout, strict=False)]

    def kill(self) -> list[str]:
        """Kill it and return the ids that it has printed."""
        self._process.kill()
        return self.rest()

    def rest(self) -> list[str]:
        """Wait until it is killed and return the ids that it has printed."""
        with self._process:
            rest = self._process.stdout.read().split()
        assert self._process.returncode == -signal.SIGKILL
        return rest

    def wait_gone(self) -> None:
        """Wait until none of its processes runs."""
        wait_until(lambda: not list(self._running()), "the end of what the server had started")

    def _running(self) -> Iterator[int]:
        for process in psutil.process_iter():
            try:
                if process.environ().get(MARK) == self._mark and is_alive(process.pid):
                    yield process.pid
            except psutil.Error:
                continue


def all_end_well(folder: Path, acknowledged: list[str]) -> None:
    """Reopen the folder: every acknowledged job exists, ends once, and its plans are in order."""

    async def run() -> None:
        async with open_jobs(folder, slots=2) as jobs:
            for job in acknowledged:
                done = await ended(jobs, job)
                assert done.outcome in (JobOutcome.OPTIMAL, JobOutcome.SATISFICING), done
                events = await events_of(jobs, job)
                assert [event.seq for event in events] == list(range(1, len(events) + 1))
                assert [event.type for event in events].count(JobEventType.END) == 1
                assert events[-1].type is JobEventType.END
                plans = [json.loads(event.data) for event in events if event.type is JobEventType.PLAN]
                assert [plan["revision"] for plan in plans] == list(range(1, done.plans + 1))
                assert [plan["makespan_ms"] for plan in plans] == sorted(
                    (plan["makespan_ms"] for plan in plans), reverse=True
                )

    asyncio.run(run())


@pytest.mark.parametrize(
    "armed", ["", "after_commit=kill@12", pytest.param("before_commit=kill@12", marks=pytest.mark.slow)]
)
def test_an_acknowledged_job_survives_the_kill_of_the_server(tmp_path: Path, armed: str) -> None:
    server = JobServer(tmp_path, "many", armed)
    acknowledged = server.acknowledged(5)
    acknowledged += server.rest() if armed else server.kill()
    assert len(acknowledged) >= 3
    server.wait_gone()
    all_end_well(tmp_path, acknowledged)


@pytest.mark.slow
def test_acknowledged_jobs_survive_many_kills_at_any_moment(tmp_path: Path) -> None:
    draw = random.Random(1)
    acknowledged: list[str] = []
    for _ in range(25):
        server = JobServer(tmp_path, "many")
        acknowledged += server.acknowledged(1)
        time.sleep(draw.uniform(0, 6))
        acknowledged += server.kill()
        server.wait_gone()
    all_end_well(tmp_path, acknowledged)


@pytest.mark.slow
async def test_a_running_job_continues_from_its_best_plan_after_the_server_was_killed(tmp_path: Path) -> None:
    server = JobServer(tmp_path, "slow")
    (job,) = server.acknowledged(1)
    server.kill()
    server.wait_gone()
    async with open_jobs(tmp_path, commands={"slow": f"{SLOW} {tmp_path / 'go'}"}) as jobs:
        (tmp_path / "go").touch()
        await planned(jobs, job, 2)
        done = await jobs.cancel(job)
        assert (done.attempts, done.plans) == (2, 2)
        first, second = await plans_of(jobs, job)
        assert first.makespan_ms > second.makespan_ms
        assert all(check(one_room(), record.plan).valid for record in (first, second))
        types = [event.type for event in await events_of(jobs, job)]
        assert types == ["state", "state", "plan", "state", "state", "plan", "end"]


@pytest.mark.parametrize("above", [0, 1, 2], ids=["worker", "supervisor", "launcher"])
async def test_a_job_survives_the_kill_of_its_processes(tmp_path: Path, above: int) -> None:
    async with open_jobs(tmp_path) as jobs:
        job, first = await start_waiting_job(jobs, tmp_path)
        worker = psutil.Process(next(p.pid for p in below_launcher() if not p.children()))
        [worker, *worker.parents()][above].kill()
        second = await pid_in(tmp_path)
        assert not is_alive(first)
        assert second != first
        (tmp_path / "go").touch()
        done = await ended(jobs, job)
        assert (done.outcome, done.attempts) == (JobOutcome.SATISFICING, 2)


@pytest.mark.parametrize(("times", "outcome"), [(2, JobOutcome.SATISFICING), (3, JobOutcome.ENGINE_FAILED)])
async def test_a_job_whose_processes_are_always_killed_is_given_up(
    tmp_path: Path, times: int, outcome: JobOutcome
) -> None:
    async with open_jobs(tmp_path) as jobs:
        done = await ended(jobs, await submit(jobs, request(Dies(tmp_path, times))))
        assert (done.outcome, done.attempts) == (outcome, 3)


async def test_stopping_ends_streams_and_processes_soon_and_jobs_continue_at_the_next_start(tmp_path: Path) -> None:
    commands = {"slow": f"{SLOW} {tmp_path / 'go'}"}
    async with open_jobs(tmp_path, slots=2, commands=commands) as jobs:
        slow = await submit(jobs, request(planner="slow"))
        hostile = await submit(jobs, request(Escapes(tmp_path)))
        waiting = await submit(jobs)
        await planned(jobs, slow)
        await pid_in(tmp_path)
        streams = [asyncio.create_task(events_of(jobs, job)) for job in (slow, hostile, waiting) for _ in range(20)]
        await asyncio.sleep(0.05)
        await jobs.stop()
        await asyncio.gather(*streams)
        assert no_job_runs()
        assert (await jobs.metrics())["jobs"][JobState.QUEUED] == 3
        assert all(job.attempts == 0 for job in await jobs.list("me"))
        types = [event.type for event in streams[0].result()]
        assert types[:3] == ["state", "state", "plan"]
        assert "end" not in types
    async with open_jobs(tmp_path, slots=2, commands=commands) as jobs:
        (tmp_path / "go").touch()
        await jobs.cancel(hostile)
        await planned(jobs, slow, 2)
        assert (await jobs.cancel(slow)).attempts == 1


async def test_stopping_does_not_wait_for_a_launcher_that_is_not_ready(tmp_path: Path) -> None:
    processes.shutdown()
    async with open_jobs(tmp_path) as jobs:
        await submit(jobs)
        await asyncio.sleep(0.1)
        await jobs.stop()
        (job,) = await jobs.list("me")
        assert (job.state, job.attempts) == (JobState.QUEUED, 0)
        assert job.started_at_ms is None
