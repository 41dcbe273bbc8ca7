"""Simulated missions have the same logs as missions in one process, whatever happens to the service."""

import asyncio
import contextlib
from pathlib import Path
from typing import Any

import psutil
import pytest
from entry_setup import followed
from mission_setup import open_missions, simulation_brief
from support.missions.reference_missions import STEPS, reference_log
from support.processes.process_tree import below_launcher
from support.services.databases import PostgresServer

from marsupial_service.entries.records import TooMany
from marsupial_service.missions.driver import CATCH_UP_S, MissionClock
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.service import Missions
from marsupial_service.missions.state import ReportConflict
from marsupial_service.missions.values import Control, MissionReport
from marsupial_service.schemas.enums import EventType, MissionPhase

LOBBY = {"scenario": "lobby", "planner": "greedy", "budget": {"steps": STEPS.steps}}
SLOW = {**LOBBY, "speed": 0.5}


async def start_simulation(missions: Missions, document: dict[str, Any], owner: str = "me") -> MissionRecord:
    record, _ = await missions.create(simulation_brief(document), b"same", owner=owner)
    return record


async def reported(missions: Missions, mission: str, n: int) -> MissionRecord:
    """Wait until a mission has `n` reports."""
    async for event in followed(missions, mission):
        if event.type == EventType.COMMANDS and (record := await missions.of("me", mission)) and record.n >= n:
            return record
    raise AssertionError("it ended before")


async def wait_until_over(missions: Missions, mission: str) -> MissionRecord:
    async for _ in followed(missions, mission):
        pass
    record = await missions.of("me", mission)
    assert record.state is MissionPhase.ENDED
    return record


async def test_the_log_equals_that_of_a_mission_in_one_process_even_after_kills(place: str) -> None:
    async with open_missions(place) as missions:
        record = await start_simulation(missions, LOBBY)
        for n in (3, 9, 20, 31):
            await reported(missions, record.id, n)
            for process in await asyncio.to_thread(below_launcher):
                with contextlib.suppress(psutil.NoSuchProcess):
                    process.kill()
        assert (await wait_until_over(missions, record.id)).status == "complete"
        assert await missions.log(record) == reference_log("lobby")


async def test_the_log_is_the_same_after_a_restart_of_the_service(place: str) -> None:
    async with open_missions(place) as missions:
        record = await start_simulation(missions, LOBBY)
        await reported(missions, record.id, 7)
        mission = record.id
    async with open_missions(place) as missions:
        assert await missions.log(await wait_until_over(missions, mission)) == reference_log("lobby")


async def test_one_of_several_servers_drives_and_the_other_takes_over(postgres: PostgresServer) -> None:
    shared = postgres.database()
    async with open_missions(shared) as second:
        async with open_missions(shared) as first:
            record = await start_simulation(first, LOBBY)
            await reported(second, record.id, 7)
        ended = await wait_until_over(second, record.id)
        assert ended.term == 2
        assert await second.log(ended) == reference_log("lobby")


async def test_robots_stop_during_a_pause_and_then_continue(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await start_simulation(missions, {**LOBBY, "speed": 20})
        await reported(missions, record.id, 5)
        await missions.control(record, Control.PAUSE)
        resting = await _resting(missions, record.id)
        assert resting.state is MissionPhase.PAUSED
        await missions.control(record, Control.RESUME)
        await reported(missions, record.id, resting.n + 3)
        await missions.control(record, Control.CANCEL)
        assert (await wait_until_over(missions, record.id)).status == "cancelled"


async def _resting(missions: Missions, mission: str) -> MissionRecord:
    """Wait until no report has arrived for half a second, twenty times their usual interval."""
    before = -1
    while True:
        record = await missions.of("me", mission)
        if record.n == before:
            return record
        before = record.n
        await asyncio.sleep(0.5)


async def test_a_cancelled_mission_gets_no_more_reports(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await start_simulation(missions, SLOW)
        await reported(missions, record.id, 2)
        await missions.control(record, Control.CANCEL)
        ended = await wait_until_over(missions, record.id)
        assert ended.status == "cancelled"
        await asyncio.sleep(0.3)
        assert await missions.of("me", record.id) == ended


async def test_others_can_not_report_for_simulated_robots(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await start_simulation(missions, SLOW)
        with pytest.raises(ReportConflict, match="the service simulates the robots"):
            await missions.reports(record, [(MissionReport(n=1, t_ms=0), b"mine")])


async def test_no_more_missions_are_simulated_at_a_time_than_allowed(place: str) -> None:
    async with open_missions(place, simulations=1) as missions:
        first = await start_simulation(missions, SLOW)
        with pytest.raises(TooMany, match="the limit of 1 simulated missions"):
            await start_simulation(missions, SLOW)
        await missions.control(first, Control.CANCEL)
        await wait_until_over(missions, first.id)
        await start_simulation(missions, SLOW)


async def test_a_key_without_a_simulated_mission_always_gets_one(place: str) -> None:
    async with open_missions(place, simulations=1) as missions:
        await start_simulation(missions, SLOW)
        await start_simulation(missions, SLOW, owner="you")
        with pytest.raises(TooMany, match="the limit of 1 simulated missions"):
            await start_simulation(missions, SLOW, owner="you")


def test_the_speed_is_kept_and_delays_are_not_caught_up() -> None:
    pace = MissionClock(10)
    assert pace.due_s(0, 100.0) == 100.0
    assert pace.due_s(5000, 100.0) == 100.5
    assert pace.due_s(5000, 100.6) == 100.5, "a little late: it hurries"
    late = 100.6 + CATCH_UP_S
    assert pace.due_s(6000, late + 1) == late + 1, "after a long planning it goes on from there"
    assert pace.due_s(7000, late + 1) == pytest.approx(late + 1.1)
    assert MissionClock(None).due_s(10**9, 5.0) == 5.0, "without a pace everything is due at once"
