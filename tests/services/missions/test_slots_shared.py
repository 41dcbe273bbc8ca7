"""Jobs and missions of one server share its slots, and missions come first."""

from __future__ import annotations

import asyncio
from pathlib import Path

from mission_house import Driver, run, started, team
from situations import many_rooms

from marsupial.model.planning import Budget
from marsupial_service.entries.slots import Slots
from marsupial_service.jobs.records import JobOutcome, JobRequest, JobSettings
from marsupial_service.jobs.service import Jobs
from marsupial_service.missions.records import MissionSettings
from marsupial_service.missions.service import Missions
from marsupial_service.store import open_store


def test_a_mission_is_planned_while_a_long_job_has_the_only_slot_and_the_job_goes_on_after(tmp_path: Path) -> None:
    wanted = JobRequest(
        planner="anytime",
        budget=Budget(seconds=8.0),
        task=many_rooms(2, 1, 6, 3),
        digest=b"",
        source={"planner": "anytime"},
    )

    async def plan() -> None:
        slots, store = Slots(1), open_store(tmp_path)
        jobs = Jobs(store, JobSettings(slots=1), slots=slots)
        missions = Missions(store, MissionSettings(), slots=slots)
        try:
            await jobs.start()
            await missions.start()
            job = (await jobs.submit(wanted, owner="me")).record.id
            while not await jobs.plans(job):
                await asyncio.sleep(0.02)
            record = await started(missions)
            assert await Driver(team()).drive(missions, record)
            done = await jobs.wait(job, 60)
            assert (done.outcome, done.attempts) == (JobOutcome.SATISFICING, 1)
        finally:
            await jobs.stop()
            await missions.stop()
            store.close()

    run(plan())
