"""Background tasks go on after failures, which are logged and counted."""

import asyncio
import logging
from collections import Counter
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import TypeVar

import pytest
from entry_setup import opened, settings_of
from mission_setup import Driver, open_missions, started, team
from support.missions.reference_missions import reference_log
from support.planning.situations import job_source, one_room
from support.waiting import HANG_S

from marsupial.model.planning import Budget
from marsupial.processes import launcher
from marsupial_service.entries.background import LOG_S, BackgroundTasks
from marsupial_service.entries.records import canonical_text
from marsupial_service.jobs import table
from marsupial_service.jobs.records import JobSettings, PackedRequest
from marsupial_service.jobs.service import Jobs

T = TypeVar("T")


def failing_twice(function: Callable[..., T]) -> Callable[..., T]:
    """Return a function that raises in its first two calls."""
    calls = count(1)

    def call(*arguments: object) -> T:
        if next(calls) <= 2:
            raise RuntimeError("nobody has foreseen this")
        return function(*arguments)

    return call


def test_a_task_that_fails_starts_again_and_is_logged_once_in_a_while(caplog: pytest.LogCaptureFixture) -> None:
    counts = Counter[str]()
    now_s = [0.0]

    async def work() -> None:
        if counts["sweep"] < 3:
            raise ZeroDivisionError

    async def supervised() -> None:
        stop = asyncio.Event()
        tasks = BackgroundTasks(stop, lambda name: counts.update([name]), lambda: now_s[0])
        await tasks.start("sweep", work)
        await tasks.start("charge", lambda: raising(), restart=False)
        now_s[0] = LOG_S
        tasks.report("sweep", ZeroDivisionError())
        stop.set()
        await tasks.start("slot", lambda: raising())
        await asyncio.sleep(0)
        assert not tasks.running

    async def raising() -> None:
        raise ZeroDivisionError

    with caplog.at_level(logging.ERROR):
        asyncio.run(supervised())
    assert counts == {"sweep": 4, "charge": 1, "slot": 1}
    logged = [(record.__dict__["task"], record.__dict__["times"]) for record in caplog.records]
    assert logged == [("sweep", 1), ("charge", 1), ("sweep", 3), ("slot", 1)]
    assert all(record.exc_info for record in caplog.records)


async def test_a_slot_continues_after_an_unexpected_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "claim", failing_twice(table.claim))
    failed: list[str] = []
    wanted = PackedRequest.of(
        planner="greedy", budget=Budget(steps=1), digest=b"", text=canonical_text(job_source(one_room()))
    )
    settings = settings_of(JobSettings, slots=1, failed=failed.append)
    async with opened(tmp_path, lambda store: Jobs(store, settings)) as jobs:
        job = (await jobs.submit(wanted, owner="me")).record.id
        found = (await jobs.wait(job, HANG_S)).finished_at_ms is not None
    assert found
    assert failed == ["job slot"] * 2


async def test_a_mission_continues_after_an_unexpected_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launcher, "run", failing_twice(launcher.run))
    failed: list[str] = []
    async with open_missions(tmp_path, failed=failed.append) as missions:
        record = await started(missions)
        assert await Driver(team()).drive(missions, record)
        assert await missions.log(await missions.of("me", record.id)) == reference_log("lobby")
    assert failed == ["mission process"] * 2
