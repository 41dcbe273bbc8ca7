from __future__ import annotations

import asyncio
from contextlib import suppress

from job_house import open_jobs, request
from lost_answers import LostAnswers
from patience import HANG_S

from marsupial_service.jobs.service import Jobs
from marsupial_service.schemas.words import JobOutcome
from marsupial_service.store import StoreError


async def surely_submitted(jobs: Jobs, key: str) -> str:
    while True:
        with suppress(StoreError):  # what was committed with a claim is lost with its answer
            return (await jobs.submit(request(), owner="me", idempotency_key=key)).record.id


async def test_jobs_that_a_server_has_got_without_being_told_so_are_run_all_the_same(place: str) -> None:
    async with open_jobs(place) as jobs:
        answers = LostAnswers(jobs._store, "claimed_ms = ?")
        made = [await surely_submitted(jobs, str(number)) for number in range(3)]
        while answers.left or jobs._is_claiming:
            await asyncio.sleep(0.02)
        await jobs._take_up()
        ends = [await jobs.wait(job, HANG_S) for job in made]
        assert [(end.outcome, end.attempts) for end in ends] == [(JobOutcome.SATISFICING, 1)] * 3
