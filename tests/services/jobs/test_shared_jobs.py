"""Jobs of several servers on one database: every server answers for a job, one runs it."""

import asyncio
from pathlib import Path

from job_setup import events_of, open_jobs, request, submit
from misbehaving_tasks import Waits
from support.waiting import HANG_S, wait_until_async

from marsupial_service.schemas.enums import JobOutcome


async def test_a_job_of_one_server_runs_on_another_which_is_notified_of_its_cancellation(
    shared: str, tmp_path: Path
) -> None:
    async with open_jobs(shared) as first, open_jobs(shared) as second:
        held = [await submit(first, request(Waits(tmp_path))), await submit(second, request(Waits(tmp_path)))]
        events = asyncio.create_task(events_of(second, held[0]))
        while {(await first.of("me", job)).state.value for job in held} != {"running"}:
            await asyncio.sleep(0.02)
        # the store shows a job as running slightly before its server starts the attempt
        await wait_until_async(lambda: [len(jobs._attempts) for jobs in (first, second)] == [1, 1])
        for job in held:
            for jobs in (second, first):
                await jobs.cancel(job)
        async with asyncio.timeout(HANG_S):
            await wait_until_async(lambda: not first._attempts and not second._attempts)
        assert [e.type for e in await events][-1] == "end"
        assert {(await first.of("me", job)).outcome for job in held} == {JobOutcome.CANCELLED}


async def test_no_job_is_claimed_twice_by_concurrent_servers(shared: str) -> None:
    async with open_jobs(shared, slots=3, queue=200) as first, open_jobs(shared, slots=3, queue=200) as second:
        jobs = [await submit((first, second)[i % 2]) for i in range(30)]
        for job in jobs:
            record = await first.wait(job, HANG_S)
            assert (record.outcome is not None, record.attempts) == (True, 1)
            types = [event.type for event in await events_of(second, job)]
            assert types.count("end") == 1


async def test_exactly_one_job_on_any_server_is_preempted_for_another_owner_s(shared: str, tmp_path: Path) -> None:
    async with open_jobs(shared) as first, open_jobs(shared) as second, open_jobs(shared) as third:
        long = [await submit(first, request(Waits(tmp_path))) for _ in range(3)]
        while {(await first.of("me", job)).state.value for job in long} != {"running"}:
            await asyncio.sleep(0.02)
        other = (await third.submit(request(), owner="you")).record.id
        assert (await first.wait(other, HANG_S)).outcome is JobOutcome.SATISFICING
        (tmp_path / "go").touch()
        for job in long:
            assert (await second.wait(job, HANG_S)).attempts == 1
        begun = [sum(event.type == "state" for event in await events_of(third, job)) for job in long]
        assert sorted(begun) == [2, 2, 4]
