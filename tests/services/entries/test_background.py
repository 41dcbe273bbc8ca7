"""Background tasks go on after failures, which are logged and counted."""

import asyncio
import logging
from collections import Counter
from pathlib import Path

import pytest
from entry_setup import opened, settings_of
from mission_setup import Driver, open_missions, started, team
from support.missions.reference_missions import reference_log
from support.planning.situations import job_source, one_room
from support.waiting import HANG_S

from marsupial.model.planning import Budget
from marsupial.processes.runner import LOCAL, Reservation
from marsupial_service.entries.background import LOG_S, BackgroundTasks
from marsupial_service.entries.records import canonical_text
from marsupial_service.jobs.records import JobSettings, PackedRequest
from marsupial_service.jobs.service import Jobs


class FailingRunner:
    """Raises in its first calls of `reserve`."""

    def __init__(self, times: int) -> None:
        self._left = times

    def __getattr__(self, name: str) -> object:
        return getattr(LOCAL, name)

    def reserve(self, cpus: float = 1.0) -> Reservation:
        if self._left:
            self._left -= 1
            raise RuntimeError("nobody has foreseen this")
        return LOCAL.reserve(cpus)


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


async def test_a_slot_continues_after_an_unexpected_error(tmp_path: Path) -> None:
    failed: list[str] = []
    wanted = PackedRequest.of(
        planner="greedy", budget=Budget(steps=1), digest=b"", text=canonical_text(job_source(one_room()))
    )
    settings = settings_of(JobSettings, slots=1, failed=failed.append, runner=FailingRunner(2))
    async with opened(tmp_path, lambda store: Jobs(store, settings)) as jobs:  # type: ignore[arg-type]
        job = (await jobs.submit(wanted, owner="me")).record.id
        found = (await jobs.wait(job, HANG_S)).finished_at_ms is not None
    assert found
    assert failed == ["job slot"] * 2


async def test_a_mission_continues_after_an_unexpected_error(tmp_path: Path) -> None:
    failed: list[str] = []
    async with open_missions(tmp_path, FailingRunner(2), failed=failed.append) as missions:  # type: ignore[arg-type]
        record = await started(missions)
        assert await Driver(team()).drive(missions, record)
        assert await missions.log(await missions.of("me", record.id)) == reference_log("lobby")
    assert failed == ["mission process"] * 2
