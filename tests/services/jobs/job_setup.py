"""Open the jobs of a store, submit requests and wait for results."""

import asyncio
import json
import sys
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from entry_setup import followed, opened, settings_of
from misbehaving_tasks import Ordinary, Waits, install_misbehaving_tasks, pid_in, source_of
from support.planning.situations import one_room
from support.waiting import HANG_S, wait_until_async

from marsupial.model import Budget, Plan, Situation
from marsupial_service.entries.documents import plan_of
from marsupial_service.entries.records import EventRecord, canonical_text
from marsupial_service.jobs import lookup
from marsupial_service.jobs.records import JobRecord, JobSettings, PackedRequest
from marsupial_service.jobs.service import Jobs

SLOW = f"cmd:{sys.executable} {Path(__file__).parent / 'slow_planner.py'} {{domain}} {{problem}}"
"""The external planner of `slow_planner.py`; append the name of the file that it waits for."""


install_misbehaving_tasks()


def open_jobs(place: Path | str, **settings: object) -> AbstractAsyncContextManager[Jobs]:
    """Yield the jobs of a store, with one slot by default."""
    usual = {"slots": 1, "steps_s": HANG_S, "queue": 100, "key_queue": 100}
    return opened(place, lambda store: Jobs(store, settings_of(JobSettings, **{**usual, **settings})))


def request(
    task: Situation | Ordinary | None = None,
    planner: str = "greedy",
    *,
    seconds: float | None = HANG_S,
    steps: int | None = None,
    digest: bytes = b"same",
) -> PackedRequest:
    budget = Budget(seconds=seconds) if steps is None else Budget(steps=steps)
    return PackedRequest.of(
        planner=planner, budget=budget, digest=digest, text=canonical_text(source_of(task or one_room()))
    )


async def submit(jobs: Jobs, wanted: PackedRequest | None = None) -> str:
    submitted = await jobs.submit(request() if wanted is None else wanted, owner="me")
    return submitted.record.id


async def start_waiting_job(jobs: Jobs, folder: Path) -> tuple[str, int]:
    """Submit a job that waits for a file, and return it with its process id once it runs."""
    job = await submit(jobs, request(Waits(folder)))
    process = await pid_in(folder)
    (folder / "pid").unlink()
    return job, process


async def ended(jobs: Jobs, job: str) -> JobRecord:
    """Return a job once it has ended, within `HANG_S`."""
    record = await jobs.wait(job, HANG_S)
    assert record.outcome is not None, f"{job} is not over: {record}"
    return record


@dataclass(frozen=True)
class StoredPlan:
    revision: int
    plan: Plan
    makespan_ms: int
    ipc: str


async def plans_of(jobs: Jobs, job: str) -> list[StoredPlan]:
    """Return all revisions of a job's plan, oldest first."""
    count = (await jobs.of("me", job)).plans
    texts = [await jobs.read(partial(lookup.plan_text, job=job, revision=number)) for number in range(1, count + 1)]
    found = [json.loads(text) for text in texts]
    return [StoredPlan(one["revision"], plan_of(one["actions"]), one["makespan_ms"], one["ipc"]) for one in found]


async def events_of(jobs: Jobs, job: str, after: int = 0) -> list[EventRecord]:
    async with asyncio.timeout(HANG_S):
        return [event async for event in followed(jobs, job, after)]


async def planned(jobs: Jobs, job: str, revision: int = 1) -> None:
    async def is_there() -> bool:
        return (await jobs.of("me", job)).plans >= revision

    await wait_until_async(is_there, f"revision {revision} of {job}")
