"""Jobs in a folder, for tests: opened, asked, closed."""

import asyncio
import sys
from contextlib import AbstractAsyncContextManager
from pathlib import Path

from entry_house import followed, opened, settings_of
from patience import HANG_S, awaited
from situations import one_room

from marsupial.model import Budget, Situation
from marsupial.processes.runner import LOCAL, Runner
from marsupial_service.analyses.mapstate import MapState
from marsupial_service.entries.records import EventRecord
from marsupial_service.jobs.records import JobRecord, JobSettings, PackedRequest
from marsupial_service.jobs.service import Jobs

SLOW = f"cmd:{sys.executable} {Path(__file__).parent / 'slow_planner.py'} {{domain}} {{problem}}"
"""The external planner of `slow_planner.py`; the name of the file it waits for is to be added."""


def open_jobs(place: Path | str, runner: Runner = LOCAL, **settings: object) -> AbstractAsyncContextManager[Jobs]:
    """Give the jobs of a folder, one at a time unless told otherwise."""
    given = settings_of(JobSettings, **{"slots": 1, "steps_s": HANG_S, "queue": 100, "key_queue": 100, **settings})
    return opened(place, lambda store: Jobs(store, given, runner=runner))


def request(
    task: Situation | MapState | None = None,
    planner: str = "greedy",
    *,
    seconds: float | None = HANG_S,
    steps: int | None = None,
    digest: bytes = b"same",
) -> PackedRequest:
    budget = Budget(seconds=seconds) if steps is None else Budget(steps=steps)
    return PackedRequest.of(
        planner=planner,
        budget=budget,
        task=one_room() if task is None else task,
        digest=digest,
        source={"planner": planner},
    )


async def submit(jobs: Jobs, wanted: PackedRequest | None = None) -> str:
    submitted = await jobs.submit(request() if wanted is None else wanted, owner="me")
    return submitted.record.id


async def ended(jobs: Jobs, job: str) -> JobRecord:
    """Return a job once it is over; a test hangs no longer than `HANG_S`."""
    record = await jobs.wait(job, HANG_S)
    assert record.outcome is not None, f"{job} is not over: {record}"
    return record


async def told(jobs: Jobs, job: str, after: int = 0) -> list[EventRecord]:
    async with asyncio.timeout(HANG_S):
        return [event async for event in followed(jobs, job, after)]


async def planned(jobs: Jobs, job: str, revision: int = 1) -> None:
    async def is_there() -> bool:
        return len(await jobs.plans(job)) >= revision

    await awaited(is_there, f"revision {revision} of {job}")
