import asyncio
import json
import tracemalloc
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from job_setup import ended, events_of, open_jobs, plans_of, request, submit
from lost_answers import LostAnswers
from misbehaving_tasks import Crashes, Escapes, Hungry, Ordinary, Paralyses, Waits, Wrong, pid_in, source_of
from support.planning.situations import many_rooms, one_hall, one_room, out_of_reach
from support.processes.process_tree import is_gone
from support.waiting import HANG_S, wait_until_async

from benchmarks.trial import failpoints
from marsupial.formats.pddl.plantext import read_plan_text
from marsupial.formats.situation import situation_from_json
from marsupial.model.objective import MAKESPAN
from marsupial.planning.checker import check
from marsupial_service.entries.capacity import StoreCapacity, StoreFull, stored_bytes
from marsupial_service.entries.records import TooMany, UnknownEntry
from marsupial_service.jobs import lookup
from marsupial_service.jobs.records import FINAL, STATE_OF
from marsupial_service.jobs.service import Jobs
from marsupial_service.schemas.enums import JobEventType, JobOutcome, JobState
from marsupial_service.store import StoreError

pytestmark = pytest.mark.usefixtures("nothing_left")

MIB = 1 << 20


async def test_a_job_reports_every_state_from_queued_to_its_end(place: str) -> None:
    async with open_jobs(place) as jobs:
        submitted = await jobs.submit(request(), owner="me")
        assert (submitted.record.state, submitted.replayed) == (JobState.QUEUED, False)
        events = await events_of(jobs, submitted.record.id)
        job = await jobs.of("me", submitted.record.id)
        assert (job.state, job.outcome) == (JobState.SUCCEEDED, JobOutcome.SATISFICING)
        assert (job.attempts, job.plans) == (1, 1)
        assert job.makespan_ms == 19_002
        moments = (job.created_at_ms, job.started_at_ms, job.first_plan_at_ms, job.finished_at_ms)
        assert sorted(moments) == list(moments)
        assert [event.type for event in events] == ["state", "state", "plan", "end"]
        assert [event.seq for event in events] == [1, 2, 3, 4]
        told_plan = json.loads(events[2].data)
        assert (told_plan["revision"], told_plan["makespan_ms"], len(told_plan["actions"])) == (1, 19_002, 3)
        end = json.loads(events[3].data)
        assert (end["state"], end["outcome"], end["plans"]) == ("succeeded", "satisficing", 1)


async def test_revisions_improve_strictly_are_valid_and_equal_the_events(tmp_path: Path) -> None:
    situation = many_rooms(2, 2, 12, 5)
    async with open_jobs(tmp_path) as jobs:
        job = await submit(jobs, request(situation, "anytime", seconds=None, steps=300))
        events = await events_of(jobs, job)
        plans = await plans_of(jobs, job)
        assert len(plans) > 1
        assert all(check(situation, record.plan).valid for record in plans)
        scores = [MAKESPAN.value(situation, record.plan) for record in plans]
        assert all(later < earlier for earlier, later in pairwise(scores))
        assert [read_plan_text(record.ipc, situation) for record in plans] == [record.plan for record in plans]
        in_events = [json.loads(event.data) for event in events if event.type is JobEventType.PLAN]
        assert [(plan["revision"], plan["makespan_ms"]) for plan in in_events] == [
            (record.revision, record.plan.makespan_ms) for record in plans
        ]


async def test_jobs_beyond_the_queue_are_refused_and_take_no_memory(place: str, tmp_path: Path) -> None:
    async with open_jobs(place, queue=4) as jobs:
        wanted = request(Waits(tmp_path))
        wanted = replace(wanted, source=wanted.source + bytes(MIB))
        first = await submit(jobs, wanted)
        await pid_in(tmp_path)
        tracemalloc.start()
        answers = await asyncio.gather(*(submit(jobs, wanted) for _ in range(40)), return_exceptions=True)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        refused = [answer for answer in answers if isinstance(answer, TooMany)]
        assert all(1 <= answer.retry_after_s <= 60 for answer in refused)
        for _ in range(36):
            with pytest.raises(TooMany):
                await submit(jobs, wanted)
        counts = (await jobs.metrics())["jobs"]
        assert (counts[JobState.RUNNING], counts[JobState.QUEUED]) == (1, 4)
        for answer in [first, *(answer for answer in answers if isinstance(answer, str))]:
            await jobs.cancel(answer)
        refused, peak = len(refused), peak
    assert refused == 36
    assert peak < 20 * MIB


async def test_jobs_run_in_their_order_and_within_the_slots(place: str) -> None:
    async with open_jobs(place, slots=2) as jobs:
        ids = [await submit(jobs, request(one_hall() if i % 2 else one_room())) for i in range(8)]
        most = 0
        async with asyncio.timeout(HANG_S):
            while (metrics := await jobs.metrics())["jobs"][JobState.SUCCEEDED] < 8:
                most = max(most, metrics["jobs"][JobState.RUNNING])
                await asyncio.sleep(0.005)
        assert most <= 2
        done = [await ended(jobs, job) for job in ids]
        assert sorted(done, key=lambda job: (job.started_at_ms, job.created_at_ms)) == done


async def test_a_job_is_preempted_for_another_owner_s_and_continues_after_it(place: str, tmp_path: Path) -> None:
    async with open_jobs(place, slots=2) as jobs:
        long = [await submit(jobs, request(Waits(tmp_path))) for _ in range(3)]
        async with asyncio.timeout(HANG_S):
            while (await jobs.metrics())["jobs"][JobState.RUNNING] < 2:  # else the other job would get a free slot
                await asyncio.sleep(0.01)
        other = (await jobs.submit(request(), owner="you")).record.id
        assert (await jobs.wait(other, HANG_S)).state is JobState.SUCCEEDED
        (tmp_path / "go").touch()
        assert [(await ended(jobs, job)).attempts for job in long] == [1, 1, 1]
        assert [event.type for event in await events_of(jobs, long[0])].count("state") == 2
        states = [json.loads(event.data)["state"] for event in await events_of(jobs, long[1]) if event.type == "state"]
        assert states == ["queued", "running", "queued", "running"]


async def test_a_queued_job_is_cancelled_without_ever_running(place: str, tmp_path: Path) -> None:
    async with open_jobs(place) as jobs:
        first, second = await submit(jobs, request(Waits(tmp_path))), await submit(jobs)
        job = await jobs.cancel(second)
        assert (job.state, job.outcome, job.attempts) == (JobState.CANCELLED, JobOutcome.CANCELLED, 0)
        assert [event.type for event in await events_of(jobs, second)] == ["state", "end"]
        await jobs.cancel(first)


@pytest.mark.parametrize("task", [Escapes, Paralyses])
async def test_a_running_job_is_cancelled_with_all_it_started_and_the_next_one_runs(
    place: str, tmp_path: Path, task: type[Escapes] | type[Paralyses]
) -> None:
    async with open_jobs(place) as jobs:
        first, second = await submit(jobs, request(task(tmp_path))), await submit(jobs)
        grandchild = await pid_in(tmp_path)
        job = await jobs.cancel(first)
        assert (job.state, job.outcome) == (JobState.CANCELLED, JobOutcome.CANCELLED)
        assert await asyncio.to_thread(is_gone, grandchild)
        assert await jobs.cancel(first) == job
        assert (await ended(jobs, second)).state is JobState.SUCCEEDED
        return grandchild


async def test_cancelling_at_any_moment_leads_to_one_end(place: str) -> None:
    async with open_jobs(place, slots=2) as jobs:
        for turn in range(15):
            job = await submit(jobs, request(one_hall()))
            follower = asyncio.create_task(events_of(jobs, job))
            await asyncio.sleep(turn * 0.006)
            answers = await asyncio.gather(*(jobs.cancel(job) for _ in range(3)))
            final = await ended(jobs, job)
            assert all(answer == final for answer in answers)
            events = await follower
            assert [event.type for event in events].count(JobEventType.END) == 1
            end = json.loads(events[-1].data)
            assert (end["state"], end["outcome"]) == (final.state, final.outcome)
            assert events == await events_of(jobs, job)


async def test_cancelling_or_awaiting_an_unknown_job_raises(tmp_path: Path) -> None:
    async with open_jobs(tmp_path) as jobs:
        with pytest.raises(UnknownEntry):
            await jobs.cancel("nobody")
        with pytest.raises(UnknownEntry):
            await jobs.wait("nobody", 1)


@pytest.mark.parametrize("planner", ["greedy", "tamer"])
async def test_at_its_limit_a_job_is_ended_with_all_it_started(tmp_path: Path, planner: str) -> None:
    async with open_jobs(tmp_path / "store") as jobs:
        seconds = 1.5
        while not (tmp_path / "pid").exists():  # a loaded machine may need longer
            seconds *= 2
            job = await submit(jobs, request(Escapes(tmp_path), planner, seconds=seconds))
            done = await ended(jobs, job)
            assert (done.state, done.outcome) == (JobState.FAILED, JobOutcome.TIMEOUT)
        assert is_gone(int((tmp_path / "pid").read_text()))


async def test_a_map_is_analysed_by_the_worker_and_the_situation_is_stored(tmp_path: Path) -> None:
    async with open_jobs(tmp_path) as jobs:
        job = await submit(jobs, request(Ordinary()))
        assert (await ended(jobs, job)).outcome is JobOutcome.SATISFICING
        analysis = await jobs.read(lambda reader: lookup.analysis(reader, job))
        assert situation_from_json(analysis.situation) == one_room()
        assert json.loads(analysis.places) == {"t1": {"rover": [3, 4]}}
        ready = await submit(jobs)
        await ended(jobs, ready)
        assert await jobs.read(lambda reader: lookup.analysis(reader, ready)) is None
        assert json.loads(await jobs.read(lambda reader: lookup.source_text(reader, ready)) or "") == source_of(
            one_room()
        )


async def test_each_way_to_end_has_its_outcome(tmp_path: Path) -> None:
    async with open_jobs(
        tmp_path, memory_bytes=400 * MIB, commands={"gone": "cmd:./nowhere {domain} {problem}"}
    ) as jobs:
        cases = {
            await submit(jobs, request(out_of_reach())): (JobOutcome.UNSOLVABLE, "t2"),
            await submit(jobs, request(Wrong())): (
                JobOutcome.INVALID_INPUT,
                "robots[0].place: is on an obstacle\nrobots[1].type: unknown",
            ),
            await submit(jobs, request(Crashes())): (JobOutcome.ENGINE_FAILED, "ValueError: boiler pressure"),
            await submit(jobs, request(Hungry())): (JobOutcome.OUT_OF_MEMORY, "the limit of 400 MiB"),
            await submit(jobs, request(planner="exact")): (JobOutcome.OPTIMAL, ""),
            await submit(jobs, request(planner="tamer")): (JobOutcome.SATISFICING, ""),
            await submit(jobs, request(planner="tamer", seconds=None, steps=3)): (
                JobOutcome.UNSUPPORTED,
                "can't count steps",
            ),
            await submit(jobs, request(planner="gone")): (JobOutcome.ENGINE_FAILED, "nowhere"),
        }
        for job, (outcome, detail) in cases.items():
            done = await ended(jobs, job)
            assert (done.outcome, done.state) == (outcome, STATE_OF[outcome]), done
            assert detail in done.detail


async def test_waiting_returns_at_the_end_or_after_the_time_given(tmp_path: Path) -> None:
    async with open_jobs(tmp_path) as jobs:
        job = await submit(jobs, request(Waits(tmp_path)))
        assert (await jobs.wait(job, 0.05)).outcome is None
        (tmp_path / "go").touch()
        assert (await jobs.wait(job, HANG_S)).state in FINAL


async def test_a_job_that_can_not_be_stored_is_refused_and_leaves_nothing(place: str, tmp_path: Path) -> None:
    async with open_jobs(place) as jobs:
        job = await submit(jobs, request(Waits(tmp_path)))
        await pid_in(tmp_path)  # the only slot is taken: nobody else writes
        failpoints.arm("before_commit=disk_full@1")
        with pytest.raises(StoreError, match="disk is full"):
            await submit(jobs)
        assert len(await jobs.list("me")) == 1
        (tmp_path / "go").touch()
        await ended(jobs, job)
        await ended(jobs, await submit(jobs))


@pytest.mark.parametrize("write", range(1, 5))
async def test_a_disk_that_is_full_for_a_moment_costs_an_attempt_at_most(
    place: str, tmp_path: Path, write: int
) -> None:
    async with open_jobs(place) as jobs:
        job = await submit(jobs, request(Waits(tmp_path)))
        await pid_in(tmp_path)
        failpoints.arm(f"before_commit=disk_full@{write}")
        (tmp_path / "go").touch()
        done = await ended(jobs, job)
        assert done.outcome is JobOutcome.SATISFICING
        assert done.attempts <= 2
        events = await events_of(jobs, job)
        assert [event.seq for event in events] == list(range(1, len(events) + 1))
        assert [event.type for event in events].count(JobEventType.END) == 1
    failpoints.arm("")


async def test_a_full_store_accepts_no_job_but_finds_its_own(place: str) -> None:
    async with open_jobs(place) as jobs:
        first = await jobs.submit(request(), owner="me", idempotency_key="k")
        await jobs.wait(first.record.id, HANG_S)
        (mine, other) = [await jobs.read(lambda c, o=owner: stored_bytes(c, o)) for owner in ("me", "you")]
        assert other == 0
        assert 1000 < mine == await jobs.read(stored_bytes) < 20_000
    async with open_jobs(place, store_bytes=mine) as jobs:
        with pytest.raises(StoreFull, match=rf"take {mine} bytes; the limit is {mine}"):
            await jobs.submit(request(), owner="you")
        assert (await jobs.submit(request(), owner="me", idempotency_key="k")).replayed
    async with open_jobs(place, store_bytes=mine, kept_jobs=0) as jobs:
        while await jobs.read(stored_bytes):
            pass
        jobs._capacity = StoreCapacity(mine)
        assert not (await jobs.submit(request(), owner="you")).replayed


async def submit_with_retries(jobs: Jobs, key: str) -> str:
    while True:
        with suppress(StoreError):  # the answer to a claim is lost with its commit
            return (await jobs.submit(request(), owner="me", idempotency_key=key)).record.id


async def test_jobs_whose_claim_lost_its_confirmation_still_run(place: str) -> None:
    async with open_jobs(place) as jobs:
        answers = LostAnswers(jobs._store, "claimed_ms = ?")
        made = [await submit_with_retries(jobs, str(number)) for number in range(3)]
        await wait_until_async(lambda: not answers.left and not jobs._is_claiming)
        await jobs._recover()
        ends = [await jobs.wait(job, HANG_S) for job in made]
        assert [(end.outcome, end.attempts) for end in ends] == [(JobOutcome.SATISFICING, 1)] * 3


async def test_a_command_line_as_the_planner_of_a_stored_job_is_not_run(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    async with open_jobs(tmp_path / "data") as jobs:
        job = await submit(jobs, request(planner=f"cmd:touch {trace} {{domain}} {{problem}}"))
        record = await ended(jobs, job)
        assert (record.outcome, record.detail) == (
            JobOutcome.UNSUPPORTED,
            "planner: must be the name of a planner, not a command line",
        )
        assert (await ended(jobs, await submit(jobs))).outcome is JobOutcome.SATISFICING
    assert not trace.exists()
