"""Jobs and missions of one server share its slots, and missions come first."""

import asyncio
from pathlib import Path

from entry_setup import settings_of
from mission_setup import Driver, started, team
from support.planning.situations import job_source, many_rooms
from support.waiting import HANG_S

from marsupial.model.planning import Budget
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


async def test_a_mission_preempts_a_long_job_in_the_only_slot_and_the_job_continues_after(tmp_path: Path) -> None:
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
