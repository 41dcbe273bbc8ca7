"""A mission has the same log after kills of its process and a stop of the service."""

import asyncio
import random
from itertools import count
from pathlib import Path

import pytest
from entry_setup import followed
from mission_setup import Driver, kill_now_and_then, open_missions, run, started, team
from support.missions.reference_missions import reference_log
from support.processes.process_tree import below_launcher, no_job_runs

from marsupial.errors import InternalError
from marsupial.processes import launcher
from marsupial.processes.jobs import Job
from marsupial.processes.launcher import JobRun
from marsupial_service.missions import supervisor
from marsupial_service.schemas.enums import MissionPhase


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 9))])
async def test_a_mission_whose_processes_are_killed_has_the_same_log(place: str, seed: int) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        driver = Driver(team())
        killing = asyncio.create_task(kill_now_and_then(below_launcher, seed, 6))
        assert await driver.drive(missions, record)
        await killing
        assert [(one.seq, one.type, one.data) async for one in followed(missions, record.id)] == driver.events
        assert await missions.log(record) == reference_log("lobby")
    assert [seq for seq, _, _ in driver.events] == list(range(1, len(driver.events) + 1))


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 5))])
def test_a_restarted_service_continues_its_missions(place: str, seed: int) -> None:
    draw = random.Random(seed)
    driver = Driver(team())

    async def fly_on(mission: str | None) -> tuple[str, str | None]:
        async with open_missions(place) as missions:
            record = await started(missions) if mission is None else await missions.of("me", mission)
            assert record.n == len(driver.reports)
            over = await driver.drive(missions, record, len(driver.reports) + draw.randint(1, 25))
            return record.id, await missions.log(record) if over else None

    mission, log = run(fly_on(None))
    while log is None:
        mission, log = run(fly_on(mission))
    assert log == reference_log("lobby")


async def test_a_mission_outlives_a_launcher_that_breaks_repeatedly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = count(1)

    def run_at_last(job: Job) -> JobRun:
        if next(tries) <= 50:
            raise InternalError("the process that starts planners can't be started")
        return launcher_run(job)

    launcher_run = launcher.run
    monkeypatch.setattr(launcher, "run", run_at_last)
    monkeypatch.setattr(supervisor, "_LONGEST_PAUSE_S", 0.001)
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        assert await Driver(team()).drive(missions, record)
        assert await missions.log(record) == reference_log("lobby")
    assert next(tries) > 51


async def test_a_mission_whose_process_dies_repeatedly_fails_with_the_reason(tmp_path: Path) -> None:
    async with open_missions(tmp_path, memory_bytes=1 << 20) as missions:
        record = await started(missions)
        events = [event async for event in followed(missions, record.id)]
        ended = await missions.of("me", record.id)
        assert (ended.state, ended.status) == (MissionPhase.ENDED, "failed")
        assert "the limit of 1 MiB" in ended.reason
        assert events[-1].type == "end"


async def test_no_process_is_left_when_missions_are_stopped(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        for _ in range(3):
            record = await started(missions)
            assert not await Driver(team()).drive(missions, record, 3)
    assert no_job_runs()
