import asyncio
import threading
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from entry_setup import followed
from lost_answers import LostAnswers
from mission_setup import Driver, body, brief, brief_from, open_missions, send, started, team
from support.missions.reference_missions import reference_log
from support.waiting import HANG_S, wait_until_async

from marsupial.formats.missionlog import parse_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.mission import Status
from marsupial.model.runs import known_runs
from marsupial.processes import launcher as processes
from marsupial.processes.jobs import Job
from marsupial_service.entries.records import TooMany
from marsupial_service.store import StoreError


@pytest.mark.parametrize(
    ("scenario", "planner", "strategy"),
    [
        ("lobby", "anytime", "temporal"),
        ("lobby", "none", "heuristic"),
        pytest.param("rooms", "greedy", "temporal", marks=pytest.mark.slow),
        pytest.param("rooms", "none", "heuristic", marks=pytest.mark.slow),
        pytest.param("office", "anytime", "temporal", marks=pytest.mark.slow),
        pytest.param("office", "none", "heuristic", marks=pytest.mark.slow),
    ],
)
async def test_a_mission_by_reports_equals_the_mission_in_process(
    place: str, scenario: str, planner: str, strategy: str
) -> None:
    async with open_missions(place) as missions:
        record = await started(missions, scenario, planner=planner, strategy=strategy)
        assert await Driver(team(scenario)).drive(missions, record)
        assert await missions.log(record) == reference_log(scenario, planner, strategy)


@pytest.mark.slow
async def test_twenty_missions_at_once_are_each_as_if_alone_and_one_more_is_refused(place: str) -> None:
    async with open_missions(place, missions=20) as missions:
        records = [await started(missions) for _ in range(20)]
        with pytest.raises(TooMany):
            await started(missions)
        over = await asyncio.gather(*(Driver(team()).drive(missions, record) for record in records))
        assert all(over)
        log = [await missions.log(record) for record in records]
    assert set(log) == {reference_log("lobby")}


async def test_a_process_that_is_ready_only_after_the_service_was_stopped_is_ended(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, stopped, closed = threading.Event(), threading.Event(), threading.Event()

    class Late:
        def close(self) -> None:
            closed.set()

    def start(job: Job) -> Late:
        begun.set()
        stopped.wait(HANG_S)
        return Late()

    monkeypatch.setattr(processes, "run", start)
    async with open_missions(place) as missions:
        await started(missions)
        assert await asyncio.to_thread(begun.wait, HANG_S)
    stopped.set()
    assert closed.wait(HANG_S)


async def test_the_map_in_the_brief_counts_as_known(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        asked = body()
        truth = builtin_scenario("lobby").grid.solid().cells
        asked["frame"]["known"] = list(known_runs(truth))
        record, _ = await missions.create(brief_from(asked), b"", owner="me")
        assert np.array_equal((await missions.known(record)).cells, truth)
        await send(missions, record, {"n": 1, "t_ms": 0})
        async for _event in followed(missions, record.id):
            pass
        log = parse_log((await missions.log(record)).encode())
    assert (log.events[-1].status, log.events[-1].coverage, log.events[-1].t_ms) == (Status.COMPLETE, 1.0, 0)


async def test_a_mission_without_reports_or_a_valid_key_is_cancelled(place: str) -> None:
    good = {"me", "you"}
    async with open_missions(place, idle_s=2.0, has_valid_key=lambda owner: owner in good) as missions:
        idle = await started(missions)
        other, _ = await missions.create(brief("lobby"), b"same", owner="you")
        good.remove("you")
        found = []
        for record, owner in ((idle, "me"), (other, "you")):
            events = [event async for event in followed(missions, record.id)]
            assert events[-1].type == "end"
            ended = await missions.of(owner, record.id)
            found.append((ended.status, ended.reason))
        await wait_until_async(lambda: not missions._supervisors)
    assert found == [("cancelled", "no report for 2 s"), ("cancelled", "the mission's key has expired or was revoked")]


async def test_the_missions_of_an_owner_are_limited(place: str) -> None:
    async with open_missions(place, key_missions=1) as missions:
        await started(missions)
        with pytest.raises(TooMany, match="your limit of 1 open missions"):
            await started(missions)
        await missions.create(brief("lobby"), b"same", owner="you")


@pytest.mark.parametrize("lost", ["batches = ?", "INSERT INTO missions"])
async def test_a_mission_continues_after_commits_whose_confirmation_was_lost(place: str, lost: str) -> None:
    async with open_missions(place) as missions:
        answers = LostAnswers(missions._store, lost, 1)
        while True:
            with suppress(StoreError):
                record, _ = await missions.create(brief(), b"same", owner="me", idempotency_key="key")
                break
        assert await Driver(team()).drive(missions, record)
        assert not answers.left or lost == "INSERT INTO missions"
        assert await missions.log(record) == reference_log("lobby")
