"""Jobs in a folder, for tests: opened, asked, closed."""

from __future__ import annotations

import asyncio
import sys
from contextlib import AbstractAsyncContextManager
from pathlib import Path

from entry_house import followed, opened
from situations import one_room

from marsupial.model.planning import Budget
from marsupial.model.situation import Situation
from marsupial.processes.runner import LOCAL, Runner
from marsupial_service.entries.records import EventRecord
from marsupial_service.jobs.records import JobRecord, JobRequest, JobSettings, MapTask
from marsupial_service.jobs.service import Jobs

SLOW = f"cmd:{sys.executable} {Path(__file__).parent / 'slow_planner.py'} {{domain}} {{problem}}"
"""The external planner of `slow_planner.py`; the name of the file it waits for is to be added."""


def open_jobs(place: Path | str, runner: Runner = LOCAL, **settings: object) -> AbstractAsyncContextManager[Jobs]:
    """Give the jobs of a folder, one at a time unless told otherwise."""
    return opened(place, lambda store: Jobs(store, JobSettings(**{"slots": 1, **settings}), runner=runner))


def request(
    task: Situation | MapTask | None = None,
    planner: str = "greedy",
    *,
    seconds: float | None = 20.0,
    steps: int | None = None,
    digest: bytes = b"same",
) -> JobRequest:
    budget = Budget(seconds=seconds) if steps is None else Budget(steps=steps)
    return JobRequest(
        planner=planner,
        budget=budget,
        task=one_room() if task is None else task,
        digest=digest,
        source={"planner": planner},
    )


async def submit(jobs: Jobs, wanted: JobRequest | None = None) -> str:
    submitted = await jobs.submit(request() if wanted is None else wanted, owner="me")
    return submitted.record.id


async def ended(jobs: Jobs, job: str) -> JobRecord:
    """Return a job once it is over; the test hangs no longer than a minute."""
    record = await jobs.wait(job, 60)
    assert record.outcome is not None, f"{job} is not over: {record}"
    return record


async def told(jobs: Jobs, job: str, after: int = 0) -> list[EventRecord]:
    async with asyncio.timeout(60):
        return [event async for event in followed(jobs, job, after)]


async def planned(jobs: Jobs, job: str, revision: int = 1) -> None:
    """Wait until a job has that revision."""
    async with asyncio.timeout(20):
        while len(await jobs.plans(job)) < revision:
            await asyncio.sleep(0.01)
