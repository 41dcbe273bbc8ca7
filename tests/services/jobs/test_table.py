from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TypeVar

import pytest
from entry_setup import settings_of
from support.waiting import HANG_S

from marsupial.model import Budget, Plan
from marsupial_service.entries.capacity import StoreCapacity
from marsupial_service.entries.records import TooMany
from marsupial_service.jobs import table
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.jobs.records import Closed, Found, JobRecord, JobSettings, PackedRequest
from marsupial_service.schemas.enums import JobOutcome, JobState
from marsupial_service.store import Store, Transaction, open_store

SETTINGS = settings_of(JobSettings, slots=1, queue=2, max_attempts=2)
MANY = settings_of(JobSettings, queue=9, key_queue=9)
LONG = Budget(seconds=30.0)
DONE = Closed(outcome=JobOutcome.SATISFICING)

T = TypeVar("T")


class Table:
    """The job table of a store, with one transaction per change."""

    def __init__(self, store: Store) -> None:
        self.store = store

    def do(self, write: Callable[[Transaction], T]) -> T:
        return self.store.write(write).result(HANG_S)

    def add(
        self,
        job: str = "j",
        owner: str = "me",
        settings: JobSettings = SETTINGS,
        planner: str = "greedy",
        budget: Budget = Budget(seconds=1.0),  # noqa: B008 (it can't be changed)
    ) -> JobRecord:
        wanted = PackedRequest(planner=planner, budget=budget, digest=b"", source=b"source")
        new = table.NewJob(id=job, owner=owner, key=None, digest=b"", request=wanted)
        return self.do(lambda tx: table.insert(tx, new, settings, StoreCapacity(), 1)).record

    def claim(self, now_ms: int = 2) -> table.Claim:
        claim = self.do(lambda tx: table.claim(tx, SETTINGS, now_ms))
        assert claim is not None
        return claim

    def preempt(self, now_ms: int) -> str | None:
        return self.do(lambda tx: table.preempt(tx, SETTINGS, now_ms))

    def recover(self, now_ms: int) -> None:
        self.do(lambda tx: table.recover(tx, SETTINGS, now_ms))

    def die_and_recover(self, now_ms: int) -> None:
        """Recover as if no server were alive, in one transaction, since the next heartbeat restores the server."""

        def write(tx: Transaction) -> None:
            tx.execute("DELETE FROM servers")
            table.recover(tx, SETTINGS, now_ms)

        self.do(write)

    def job(self, job: str = "j") -> JobRecord:
        return self.store.read(lambda c: JOBS.existing(c, job)).result(HANG_S)


@pytest.fixture
def jobs(place: str) -> Iterator[Table]:
    store = open_store(place)
    yield Table(store)
    store.close()


def found(makespan_ms: int) -> Found:
    return Found(score=(makespan_ms, 0, 0), makespan_ms=makespan_ms, actions="[]", ipc="")


def test_a_job_is_finished_once_by_its_own_attempt_only(jobs: Table) -> None:
    jobs.add()
    first = jobs.claim()
    assert jobs.do(lambda tx: table.requeue(tx, first, "killed", SETTINGS, 3))
    second = jobs.claim()
    assert not jobs.do(lambda tx: table.finish(tx, first, DONE, SETTINGS, 4))
    assert jobs.do(lambda tx: table.finish(tx, second, DONE, SETTINGS, 5))
    assert not jobs.do(lambda tx: table.finish(tx, second, DONE, SETTINGS, 6))
    jobs.do(lambda tx: table.cancel(tx, "j", SETTINGS, 7))
    assert (jobs.job().state, jobs.job().finished_at_ms) == (JobState.SUCCEEDED, 5)


def test_writes_of_a_server_that_has_lost_its_job_are_ignored(jobs: Table) -> None:
    jobs.add()
    first = jobs.claim()
    jobs.die_and_recover(3)
    second = jobs.claim()
    assert (second.attempt, second.term) == (first.attempt + 1, first.term + 1)
    assert not jobs.do(lambda tx: table.add_plan(tx, first, found(10), 4))
    assert not jobs.do(lambda tx: table.finish(tx, first, DONE, SETTINGS, 4))
    assert not jobs.do(lambda tx: table.requeue(tx, first, "", SETTINGS, 4))
    assert jobs.do(lambda tx: table.finish(tx, second, DONE, SETTINGS, 5))


def test_a_plan_that_is_not_better_is_not_kept(jobs: Table) -> None:
    jobs.add()
    claim = jobs.claim()
    kept = [jobs.do(lambda tx, ms=ms: table.add_plan(tx, claim, found(ms), 3)) for ms in (10, 10, 12, 9, 9)]
    assert kept == [True, False, False, True, False]
    assert (jobs.job().plans, jobs.job().first_plan_at_ms) == (2, 3)


def test_the_next_attempt_begins_with_the_best_plan(jobs: Table) -> None:
    jobs.add()
    claim = jobs.claim()
    assert claim.start is None
    jobs.do(lambda tx: table.add_plan(tx, claim, found(9), 3))
    jobs.do(lambda tx: table.requeue(tx, claim, "", SETTINGS, 4))
    again = jobs.claim()
    assert (again.start, again.source) == (Plan(actions=()), b"source")


def test_lost_attempts_count_and_preempted_ones_do_not(jobs: Table) -> None:
    jobs.add()
    for _ in range(5):
        claim = jobs.claim()
        assert jobs.do(lambda tx, claim=claim: table.requeue(tx, claim, "", SETTINGS, 3))
    assert jobs.job().attempts == 0
    jobs.claim()
    jobs.recover(4)
    assert (jobs.job().state, jobs.job().attempts) == (JobState.RUNNING, 1)
    jobs.die_and_recover(4)
    assert (jobs.job().state, jobs.job().attempts) == (JobState.QUEUED, 1)
    jobs.claim()
    jobs.die_and_recover(5)
    assert (jobs.job().outcome, jobs.job().attempts) == (JobOutcome.ENGINE_FAILED, 2)


def test_the_time_of_a_preempted_attempt_is_subtracted_from_the_budget(jobs: Table) -> None:
    jobs.add()
    first = jobs.claim()
    assert first.budget.seconds == 1.0
    jobs.do(lambda tx: table.requeue(tx, first, "", SETTINGS, 602))
    second = jobs.claim()
    assert second.budget.seconds == pytest.approx(0.4)
    jobs.do(lambda tx: table.requeue(tx, second, "killed", SETTINGS, 900))
    assert jobs.claim().budget.seconds == pytest.approx(0.4)
    assert jobs.job().budget.seconds == 1.0


def test_a_planner_that_starts_from_scratch_gets_its_budget_twice_at_most(jobs: Table) -> None:
    jobs.add(planner="aries", budget=Budget(seconds=4.0))
    lefts = []
    for begun_ms in (0, 10_000, 20_000):
        claim = jobs.do(lambda tx, at=begun_ms: table.claim(tx, SETTINGS, at))
        lefts.append(claim.budget.seconds)
        jobs.do(lambda tx, c=claim, at=begun_ms: table.requeue(tx, c, "", SETTINGS, at + 3000))
    assert lefts == [4.0, 4.0, 2.0]


def test_a_requeued_job_precedes_later_ones(jobs: Table) -> None:
    jobs.add("a")
    jobs.add("b")
    claim = jobs.claim()
    jobs.do(lambda tx: table.requeue(tx, claim, "killed", SETTINGS, 3))
    assert jobs.claim().id == "a"


def test_owners_alternate_however_many_jobs_one_has(jobs: Table) -> None:
    for job in ("a1", "a2", "a3", "b1", "c1", "b2"):
        jobs.add(job, job[0], MANY)
    first = [jobs.claim() for _ in range(3)]
    assert [claim.id for claim in first] == ["a1", "b1", "c1"]
    for claim in first:
        jobs.do(lambda tx, claim=claim: table.finish(tx, claim, DONE, SETTINGS, 3))
    jobs.add("c2", "c", MANY)
    assert [jobs.claim().id for _ in range(4)] == ["a2", "b2", "c2", "a3"]


def test_an_owner_without_running_jobs_comes_first(jobs: Table) -> None:
    for job in ("a1", "a2", "b1"):
        jobs.add(job, job[0], MANY)
    jobs.claim()
    done = jobs.claim()
    assert done.id == "b1"
    jobs.do(lambda tx: table.finish(tx, done, DONE, SETTINGS, 3))
    jobs.add("b2", "b", MANY)
    assert jobs.claim().id == "b2"


def test_the_newest_job_of_the_owner_with_the_most_is_preempted_after_a_second_and_once(jobs: Table) -> None:
    for job in ("a1", "a2", "a3"):
        jobs.add(job, "a", MANY, budget=LONG)
        jobs.claim(now_ms=10)
    jobs.add("b1", "b", MANY, budget=LONG)
    jobs.claim(now_ms=15)
    assert jobs.preempt(1900) is None  # no job waits
    jobs.do(lambda tx: tx.execute("UPDATE jobs SET claimed_ms = 20 WHERE id = 'a2'"))
    jobs.add("c1", "c", MANY)  # since 1 ms
    assert jobs.preempt(1000) is None
    assert jobs.preempt(1001) == "a2"
    assert jobs.preempt(1500) is None  # a slot is free
    record = jobs.job("a2")
    assert (record.state, record.attempts) == (JobState.QUEUED, 0)
    assert jobs.claim(1501).id == "c1"
    assert jobs.preempt(9000) is None
    assert jobs.claim(9000).budget.seconds == pytest.approx(30 - 0.981)


def test_jobs_that_would_start_from_scratch_are_preempted_last(jobs: Table) -> None:
    kinds = (("a1", "greedy", LONG), ("a2", "aries", LONG), ("a3", "greedy", Budget(steps=10)))
    for at_ms, (job, planner, budget) in enumerate(kinds):
        jobs.add(job, "a", MANY, planner, budget)
        jobs.claim(at_ms)
    jobs.add("b1", "b", MANY)
    assert jobs.preempt(2000) == "a1"
    assert jobs.preempt(3000) == "a3"


def test_the_only_job_of_an_owner_runs_as_long_as_its_earlier_attempts_before_preemption(jobs: Table) -> None:
    jobs.add("a1", "a", MANY, budget=LONG)
    jobs.claim(now_ms=1)
    jobs.add("b1", "b", MANY)
    assert jobs.preempt(1000) is None
    assert jobs.preempt(5001) == "a1"
    jobs.do(lambda tx: tx.execute("UPDATE jobs SET queued_ms = 90000 WHERE id = 'b1'"))
    assert jobs.claim(6000).id == "b1"
    jobs.do(lambda tx: tx.execute("UPDATE jobs SET state = 'queued' WHERE id = 'b1'"))
    assert jobs.claim(90_000).id == "a1"
    assert jobs.preempt(94_999) is None
    assert jobs.preempt(95_000) == "a1"


def test_no_job_is_preempted_for_an_owner_whose_last_one_just_ended(jobs: Table) -> None:
    jobs.add("b1", "b", MANY)
    former = jobs.claim(now_ms=1)
    jobs.add("a1", "a", MANY, budget=LONG)
    jobs.claim(now_ms=1)
    jobs.add("b2", "b", MANY)
    jobs.do(lambda tx: table.finish(tx, former, DONE, SETTINGS, 5000))
    assert jobs.preempt(5999) is None
    assert jobs.preempt(6000) == "a1"
    assert jobs.claim(6001).id == "b2"
    jobs.do(lambda tx: tx.execute("UPDATE jobs SET queued_ms = 1 WHERE id = 'a1'"))
    jobs.do(lambda tx: tx.execute("UPDATE jobs SET claimed_ms = 1 WHERE id = 'b2'"))
    assert jobs.preempt(6999) is None  # its slot was just freed
    assert jobs.preempt(7000) == "b2"


def test_a_preempted_attempt_changes_nothing(jobs: Table) -> None:
    jobs.add("a1", "a", MANY, budget=LONG)
    former = jobs.claim(now_ms=1)
    jobs.add("b1", "b", MANY)
    jobs.preempt(5001)
    jobs.claim(5002)
    assert jobs.store.read(lambda c: table.is_running(c, former)).result(HANG_S) is False
    assert jobs.do(lambda tx: table.finish(tx, former, DONE, SETTINGS, 5003)) is False
    assert jobs.do(lambda tx: table.requeue(tx, former, "", SETTINGS, 5003)) is False


def test_one_owner_can_not_fill_the_queue(jobs: Table) -> None:
    few = settings_of(JobSettings, queue=9, key_queue=2)
    jobs.add("a1", "a", few)
    jobs.add("a2", "a", few)
    with pytest.raises(TooMany, match="your part of the queue is full"):
        jobs.add("a3", "a", few)
    jobs.add("b1", "b", few)


def test_a_removed_job_leaves_no_rows(jobs: Table) -> None:
    jobs.add()
    claim = jobs.claim()
    jobs.do(lambda tx: table.add_plan(tx, claim, found(9), 3))
    jobs.do(lambda tx: table.finish(tx, claim, DONE, SETTINGS, 3))
    assert jobs.do(lambda tx: JOBS.remove_old(tx, 10, 10_000, 10_004)) == 1
    tables = ("jobs", "payloads", "plans", "events")
    counts = jobs.do(lambda tx: [tx.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in tables])
    assert counts == [0, 0, 0, 0]


def test_a_gap_needs_a_plan_and_a_bound(jobs: Table) -> None:
    jobs.add()
    claim = jobs.claim()
    assert jobs.job().gap is None
    jobs.do(lambda tx: table.add_plan(tx, claim, found(10), 3))
    jobs.do(lambda tx: table.finish(tx, claim, Closed(outcome=JobOutcome.SATISFICING, lower_bound_ms=8), SETTINGS, 4))
    assert jobs.job().gap == pytest.approx(0.2)


def test_a_list_of_jobs_reads_no_plans(jobs: Table) -> None:
    jobs.add()
    claim = jobs.claim()
    unread = replace(found(7), actions="of no plan")
    assert jobs.do(lambda tx: table.add_plan(tx, claim, unread, 3))
    (listed,) = jobs.store.read(lambda reader: JOBS.newest(reader, "me", 200)).result(HANG_S)
    assert (listed.plans, listed.makespan_ms) == (1, 7)
