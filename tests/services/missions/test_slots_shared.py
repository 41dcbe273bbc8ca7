"""Jobs and missions of one server share its slots, and missions come first."""

import asyncio
import threading
from pathlib import Path

from entry_setup import opened, settings_of
from mission_setup import Driver, started, team
from support.planning.situations import job_source, many_rooms
from support.waiting import HANG_S, wait_until_async

from marsupial.model.planning import Budget
from marsupial.processes.jobs import Job
from marsupial.processes.launcher import JobRun
from marsupial.processes.runner import LocalRunner
from marsupial_service.entries.records import canonical_text
from marsupial_service.entries.slots import Slots
from marsupial_service.jobs.records import JobSettings, PackedRequest
from marsupial_service.jobs.service import Jobs
from marsupial_service.missions.records import MissionSettings
from marsupial_service.missions.service import Missions
from marsupial_service.schemas.enums import JobOutcome
from marsupial_service.store import open_store

TEXT = canonical_text(job_source(many_rooms(2, 1, 6, 3)))
WANTED = PackedRequest.of(planner="anytime", budget=Budget(seconds=3.0), digest=b"", text=TEXT)


class NoRoom:
    """A reservation that is never granted."""

    def __init__(self) -> None:
        self._closed = threading.Event()

    def wait(self) -> bool:
        self._closed.wait()
        return False

    def run(self, job: Job) -> JobRun:
        raise AssertionError(job)

    def close(self) -> None:
        self._closed.set()


class FullRunner(LocalRunner):
    """A runner without room, which counts reservations."""

    asked = 0

    def reserve(self, cpus: float = 1.0) -> NoRoom:
        self.asked += 1
        return NoRoom()


async def test_a_mission_preempts_a_long_job_in_the_only_slot_and_the_job_continues_after(
    tmp_path: Path,
) -> None:
    slots, store = Slots(1), open_store(tmp_path)
    jobs = Jobs(store, settings_of(JobSettings, slots=1), slots=slots)
    missions = Missions(store, MissionSettings(), slots=slots)
    try:
        await jobs.start()
        await missions.start()
        job = (await jobs.submit(WANTED, owner="me")).record.id
        while not (await jobs.of("me", job)).plans:
            await asyncio.sleep(0.02)
        record = await started(missions)
        assert await Driver(team()).drive(missions, record)
        done = await jobs.wait(job, HANG_S)
        assert (done.outcome, done.attempts) == (JobOutcome.SATISFICING, 1)
    finally:
        await jobs.stop()
        await missions.stop()
        store.close()


async def test_a_job_that_waits_for_room_yields_its_slot_to_a_mission_and_waits_again(tmp_path: Path) -> None:
    slots, runner = Slots(1), FullRunner()
    settings = settings_of(JobSettings, slots=1, runner=runner)
    async with opened(tmp_path, lambda store: Jobs(store, settings, slots)) as jobs:
        await jobs.submit(WANTED, owner="me")
        await wait_until_async(lambda: slots.in_use)
        async with asyncio.timeout(HANG_S):
            with slots.holding(await slots.for_owner("me")):
                assert runner.asked == 1
            await wait_until_async(lambda: runner.asked > 1)
        (record,) = await jobs.list("me")
        assert (record.state.value, record.attempts) == ("queued", 0)
