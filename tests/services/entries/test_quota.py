"""The quota of planning time of a key per hour, over all servers of a store."""

import asyncio
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import pytest
from entry_setup import followed, opened, settings_of
from mission_setup import Driver, open_missions, started, team
from support.missions.reference_missions import reference_log
from support.planning.situations import job_source, one_room
from support.waiting import HANG_S

from marsupial.model.planning import Budget
from marsupial_service.entries.capacity import StoreCapacity
from marsupial_service.entries.quota import Quota
from marsupial_service.entries.records import TooMany, canonical_text
from marsupial_service.jobs import table
from marsupial_service.jobs.records import Closed, JobSettings, PackedRequest
from marsupial_service.jobs.service import Jobs
from marsupial_service.missions.service import Missions
from marsupial_service.missions.values import Control
from marsupial_service.schemas.enums import JobOutcome
from marsupial_service.schemas.events import QuotaData
from marsupial_service.store import Store, Transaction, open_store

T = TypeVar("T")

SETTINGS = settings_of(JobSettings, max_attempts=2, key_planning_s=60.0, steps_s=40.0)
QUOTA = Quota(SETTINGS.limits)
"""It refills by one second per minute."""

RESTARTING = replace(SETTINGS, commands={"greedy": "cmd:greedy"})
NO_QUOTA = Quota(JobSettings().limits)
DONE = Closed(outcome=JobOutcome.SATISFICING)
MINUTE_MS = 60_000


@dataclass
class QuotaStore:
    """A store, read and written at times set by the test."""

    store: Store

    def do(self, write: Callable[[Transaction], T]) -> T:
        return self.store.write(write).result(HANG_S)

    def add(self, job: str, now_ms: int, owner: str = "me", **budget: float) -> None:
        asked = Budget(**(budget or {"seconds": 10.0}))  # type: ignore[arg-type]
        wanted = PackedRequest(planner="greedy", budget=asked, digest=b"", source=b"")
        new = table.NewJob(id=job, owner=owner, key=None, digest=b"", request=wanted)
        self.do(lambda tx: table.insert(tx, new, SETTINGS, StoreCapacity(), now_ms))

    def claim(self, now_ms: int) -> table.Claim:
        claim = self.do(lambda tx: table.claim(tx, SETTINGS, now_ms))
        assert claim is not None
        return claim

    def left_s(self, now_ms: int, owner: str = "me") -> float:
        return self.store.read(lambda reader: QUOTA.left_s(reader, now_ms)).result(HANG_S).get(owner, 60.0)


@pytest.fixture
def quota(place: str) -> Iterator[QuotaStore]:
    store = open_store(place)
    yield QuotaStore(store)
    store.close()


def test_jobs_reserve_their_budgets_and_what_goes_beyond_is_refused_until_there_is_room(quota: QuotaStore) -> None:
    quota.add("a", 0, seconds=15.0)
    quota.add("b", 0, steps=1000)
    assert quota.left_s(0) == 5.0
    said = r"60 s per hour \(key_planning_s\) .*; 10 s may be available in 300 s$"
    with pytest.raises(TooMany, match=said) as caught:
        quota.add("c", 0)
    assert caught.value.retry_after_s == 300
    quota.add("c", 0, seconds=5.0)
    quota.add("of_another", 0, owner="you", seconds=60.0)


def test_planning_time_is_charged_at_the_end_and_refills_within_an_hour(quota: QuotaStore) -> None:
    quota.add("a", 0, seconds=30.0)
    claim = quota.claim(1000)
    assert quota.left_s(1000) == 30.0
    assert quota.do(lambda tx: table.finish(tx, claim, DONE, SETTINGS, 13_000))
    assert quota.left_s(13_000) == pytest.approx(48.0)
    assert quota.left_s(13_000 + 3 * MINUTE_MS) == pytest.approx(51.0)
    assert quota.left_s(13_000 + 12 * MINUTE_MS) == pytest.approx(60.0)
    assert quota.left_s(13_000 + 90 * MINUTE_MS) == 60.0


def test_a_job_that_is_cancelled_is_charged_once_if_it_ran(quota: QuotaStore) -> None:
    quota.add("b", 0)
    quota.do(lambda tx: table.cancel(tx, "b", SETTINGS, 9000))
    assert quota.left_s(9000) == 60.0
    quota.add("a", 0)
    claim = quota.claim(0)
    for now_ms in (6000, 8000):
        quota.do(lambda tx, now_ms=now_ms: table.cancel(tx, "a", SETTINGS, now_ms))  # type: ignore[misc]
    assert not quota.do(lambda tx: table.finish(tx, claim, DONE, SETTINGS, 9000))
    assert quota.left_s(6000) == pytest.approx(54.0)


def test_one_that_began_again_from_nothing_is_charged_for_all_attempts_and_reserves_nothing_beyond(
    quota: QuotaStore,
) -> None:
    quota.add("a", 0)
    for begun_ms in (0, 8000):
        claim = quota.do(lambda tx, at=begun_ms: table.claim(tx, RESTARTING, at))  # type: ignore[misc]
        quota.do(lambda tx, c=claim, at=begun_ms: table.requeue(tx, c, "", SETTINGS, at + 8000, 8000))  # type: ignore[misc]
    assert quota.left_s(16_000) == pytest.approx(44.0, abs=0.3)


def test_a_job_that_makes_room_for_a_mission_reserves_what_is_left_of_its_budget(quota: QuotaStore) -> None:
    quota.add("a", 0)
    claim = quota.claim(0)
    assert quota.do(lambda tx: table.requeue(tx, claim, "", SETTINGS, 4000))
    assert quota.left_s(4000) == pytest.approx(50.0)
    again = quota.claim(5000)
    assert again.budget.seconds == pytest.approx(6.0)
    quota.do(lambda tx: table.finish(tx, again, DONE, SETTINGS, 7000))
    assert quota.left_s(7000) == pytest.approx(54.0, abs=0.1)


def test_an_attempt_whose_server_died_long_ago_is_charged_no_more_than_its_budget_and_preparation(
    quota: QuotaStore,
) -> None:
    quota.add("a", 0)
    quota.claim(0)

    def recover(tx: Transaction) -> None:
        tx.execute("DELETE FROM servers")  # in the same transaction, as the next heartbeat brings the server back
        table.recover(tx, SETTINGS, 50 * MINUTE_MS)

    quota.do(recover)
    assert quota.left_s(50 * MINUTE_MS) == pytest.approx(39.0)


def test_a_small_budget_reserves_what_preparing_for_it_takes(quota: QuotaStore) -> None:
    for i in range(60):
        quota.add(f"job{i}", 0, seconds=0.001)
    with pytest.raises(TooMany, match="key_planning_s"):
        quota.add("one_too_many", 0, seconds=0.001)


def wanted(seconds: float) -> PackedRequest:
    budget = Budget(seconds=seconds)
    return PackedRequest.of(planner="greedy", budget=budget, digest=b"", text=canonical_text(job_source(one_room())))


async def test_jobs_of_a_millisecond_are_charged_for_all_that_they_took(place: str) -> None:
    used_s: list[float] = []

    def jobs_of(store: Store) -> Jobs:
        calls = {"now_ms": lambda: 0, "planned": lambda owner, seconds: used_s.append(seconds)}
        return Jobs(store, settings_of(JobSettings, slots=2, key_planning_s=60.0, **calls))  # nothing comes back

    async with opened(place, jobs_of) as jobs:
        for job in [(await jobs.submit(wanted(0.001), owner="me")).record.id for _ in range(5)]:
            await jobs.wait(job, 60)
        left = (await jobs.left_s())["me"]
    assert len(used_s) == 5
    assert 60.0 - left == pytest.approx(sum(used_s), abs=0.005)
    assert sum(used_s) > 5 * 0.002


async def test_a_mission_is_charged_for_its_analyses_and_plannings(place: str) -> None:
    charged_s: list[float] = []
    driver = Driver(team())
    async with open_missions(place, planned=lambda owner, seconds: charged_s.append(seconds)) as missions:
        assert await driver.drive(missions, await started(missions))
    charges, plannings = len(charged_s), sum(kind == "decision" for _, kind, _ in driver.events)
    assert charges > plannings


def test_servers_charge_the_same_owner_at_the_same_time_and_nothing_is_lost(postgres: Any) -> None:
    address = postgres.database()
    stores = [open_store(address) for _ in range(2)]
    try:
        charges = [
            store.write(lambda tx, owner=owner: QUOTA.charge(tx, owner, 1000, 0))  # type: ignore[misc]
            for _ in range(10)
            for store, owners in zip(stores, (("me", "you"), ("you", "me")), strict=True)
            for owner in owners
        ]
        for charge in charges:
            charge.result(HANG_S)
        left = stores[0].read(lambda reader: QUOTA.left_s(reader, 0)).result(HANG_S)
        assert left == {"me": pytest.approx(40.0), "you": pytest.approx(40.0)}
    finally:
        for store in stores:
            store.close()


def test_without_a_quota_nothing_is_recorded_and_no_job_waits(quota: QuotaStore) -> None:
    quota.do(lambda tx: NO_QUOTA.charge(tx, "me", 10**9, 0))
    rows = quota.do(lambda tx: tx.execute("SELECT * FROM documents").fetchall())
    assert len(rows) == 0
    assert quota.do(lambda tx: NO_QUOTA.wait_s(tx, "me", 1e9, 0)) == 0.0


async def test_it_holds_after_a_restart(place: str) -> None:
    def jobs_of(store: Store) -> Jobs:
        return Jobs(store, settings_of(JobSettings, slots=1, key_planning_s=30.0))

    async with opened(place, jobs_of) as jobs:
        job = (await jobs.submit(wanted(20.0), owner="me")).record.id
        assert (await jobs.wait(job, HANG_S)).finished_at_ms is not None
        assert 0 < 30.0 - (await jobs.left_s())["me"] < 20.0
    async with opened(place, jobs_of) as jobs:
        with pytest.raises(TooMany, match="planning quota"):
            await jobs.submit(wanted(30.0), owner="me")


async def use_up(missions: Missions, seconds: float) -> None:
    await missions.write(lambda tx: missions.quota.charge(tx, "me", round(1000 * seconds), missions.now_ms()))


def quota_events(driver: Driver) -> list[str]:
    return [data for _, kind, data in driver.events if kind == "quota"]


async def until_told(driver: Driver) -> None:
    while not quota_events(driver):
        await asyncio.sleep(0.02)


@pytest.mark.parametrize("killed", [False, True])
async def test_a_mission_beyond_the_quota_waits_reports_it_and_continues_unchanged(place: str, killed: bool) -> None:
    driver = Driver(team())
    async with open_missions(place, key_planning_s=3600.0) as missions:
        record = await started(missions)
        assert not await driver.drive(missions, record, 5)
        await use_up(missions, 4600.0)  # a second returns in each second, however slow the machine is
        ending = asyncio.create_task(driver.drive(missions, record))
        await until_told(driver)
        if killed:
            ending.cancel()
        await use_up(missions, -1060.0)  # enough for the rest of the mission on any machine
        await asyncio.wait([ending])
        assert killed or ending.result()
    async with open_missions(place, key_planning_s=3600.0) as missions:
        assert not killed or await driver.drive(missions, record)
        log = await missions.log(await missions.of("me", record.id))
    first, last = [QuotaData.model_validate_json(data) for data in quota_events(driver)]
    assert (first.state, last.state) == ("waiting", "running")
    assert "planning quota of" in (first.reason or "")
    assert first.room_at is not None
    assert log == reference_log("lobby")


async def test_a_mission_that_waits_can_be_cancelled_and_no_other_begins(place: str) -> None:
    async with open_missions(place, key_planning_s=3600.0) as missions:
        record = await started(missions)
        driver = Driver(team())
        assert not await driver.drive(missions, record, 5)
        await use_up(missions, 7000.0)
        ending = asyncio.create_task(driver.drive(missions, record))
        await until_told(driver)
        with pytest.raises(TooMany, match=r"key_planning_s"):
            await started(missions)
        ending.cancel()  # its next report could arrive after the end
        await asyncio.wait([ending])
        await missions.control(record, Control.CANCEL)
        told = [event.type async for event in followed(missions, record.id, driver.after)]
        assert told[-1] == "end"
        ended = await missions.of("me", record.id)
    assert (ended.status, ended.reason) == ("cancelled", "cancelled")
