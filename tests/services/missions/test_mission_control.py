"""Pausing, resuming, cancelling; commands that fail, robots that are lost, maps that change."""

import asyncio
import contextlib
import json
import random
from pathlib import Path
from typing import Any

import pytest
from entry_setup import followed
from mission_setup import Driver, Hosted, body, brief_from, open_missions, send, started, team

from marsupial.formats.loglines import trigger_text
from marsupial.formats.missionlog import parse_log
from marsupial.model.mission import Changed, MissionEnded, MissionStarted, Planned, RobotLost, Status
from marsupial.model.runs import cells_in, known_runs
from marsupial_service.entries.records import KeyReused
from marsupial_service.missions.simulated import SimulatedTeam
from marsupial_service.missions.state import ReportConflict
from marsupial_service.missions.values import Control, MissionBatch, PendingInput
from marsupial_service.schemas.enums import MissionPhase


def ended(log: str) -> MissionEnded:
    end = parse_log(log.encode()).events[-1]
    assert isinstance(end, MissionEnded)
    return end


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
async def test_a_mission_paused_and_resumed_at_any_moment_completes(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        driver = Driver(team())
        with contextlib.suppress(ReportConflict):  # a control after the end, which is checked below
            while not await driver.drive(missions, record, len(driver.reports) + draw.randint(1, 9)):
                paused = await missions.control(record, Control.PAUSE)
                assert paused.state is MissionPhase.PAUSED
                assert (await missions.control(record, Control.PAUSE)).inputs == paused.inputs
                with contextlib.suppress(TimeoutError):  # it stops reporting once all robots stand
                    async with asyncio.timeout(1):
                        await driver.drive(missions, record)
                assert (await missions.control(record, Control.RESUME)).state is MissionPhase.RUNNING
        end = ended(await missions.log(record))
        assert (end.status, end.coverage) == (Status.COMPLETE, 1.0)
        assert len(end.aboard) == 4
        assert_only_stops_while_paused(driver)


async def test_a_late_copy_of_a_request_changes_nothing_even_after_a_restart(place: str) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        assert (await missions.control(record, Control.PAUSE, "one")).state is MissionPhase.PAUSED
        await missions.control(record, Control.PAUSE, "two")  # changes nothing, then or later
        await missions.control(record, Control.RESUME, "three")
        for key in ("one", "two"):
            assert (await missions.control(record, Control.PAUSE, key)).state is MissionPhase.RUNNING
    async with open_missions(place) as missions:
        record = await missions.of("me", record.id)
        for key in ("one", "two"):
            assert (await missions.control(record, Control.PAUSE, key)).state is MissionPhase.RUNNING
        with pytest.raises(KeyReused):
            await missions.control(record, Control.RESUME, "one")
        driver = Driver(team())
        await driver.drive(missions, record)
        assert ended(await missions.log(record)).status is Status.COMPLETE
        states = [json.loads(data)["state"] for _, kind, data in driver.events if kind == "state"]
        assert states == ["paused", "running"]
        assert (await missions.control(record, Control.PAUSE, "one")).state is MissionPhase.ENDED
        with pytest.raises(ReportConflict, match="has ended"):
            await missions.control(record, Control.PAUSE, "four")


def assert_only_stops_while_paused(driver: Driver) -> None:
    paused, pauses = False, 0
    for _, kind, data in driver.events:
        fields = json.loads(data)
        if kind == "state":
            paused = fields["state"] == "paused"
            pauses += paused
        elif kind == "commands" and paused:
            assert {command["name"] for command in fields["commands"]} <= {"stop"}
    assert pauses > 1


@pytest.mark.parametrize("reports", [0, 1, 20])
async def test_a_mission_is_cancelled_once_with_its_stop_report(tmp_path: Path, reports: int) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        driver = Driver(team())
        if reports:
            assert not await driver.drive(missions, record, reports)
        first = await missions.control(record, Control.CANCEL)
        assert first.state is MissionPhase.CANCELLING
        with pytest.raises(ReportConflict, match="is being cancelled"):
            await missions.control(record, Control.PAUSE)
        events = [event async for event in followed(missions, record.id)]
        assert [event.type for event in events].count("end") == 1
        last = [json.loads(event.data) for event in events if event.type == "commands"][-1]
        assert all(command["name"] == "stop" for command in last["commands"])
        assert (await missions.control(record, Control.CANCEL)).status == "cancelled"
        assert ended(await missions.log(record)).status is Status.CANCELLED
        with pytest.raises(ReportConflict, match="has ended"):
            await send(missions, record, {"n": reports + 1, "t_ms": 10**9})


class FailingTeam(SimulatedTeam):
    """Reports drives as failed when they end, if `fails(id)` is true."""

    fails = staticmethod(lambda number: number % 7 == 0)

    def answer(self, batch: Any) -> dict[str, Any] | None:
        report = super().answer(batch)
        if report is None:
            return None
        drives = {c["id"] for c in batch["commands"] if c["name"] == "drive"}
        self.drives = getattr(self, "drives", set()) | drives
        failed = [number for number in report["finished"] if number in self.drives and self.fails(number)]
        report["finished"] = [number for number in report["finished"] if number not in failed]
        report["failed"] = [{"id": number, "reason": "a chair"} for number in failed]
        return report


def failing_team() -> FailingTeam:
    made = team()
    made.__class__ = FailingTeam
    return made  # type: ignore[return-value]


async def test_a_command_that_fails_is_followed_by_a_new_plan(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        driver = Driver(failing_team())
        assert await driver.drive(missions, record)
        log = await missions.log(record)
        assert ended(log).status is Status.COMPLETE
        plans = [event for event in parse_log(log.encode()).events if isinstance(event, Planned)]
        assert sum(trigger_text(plan.trigger).startswith("failed: ") for plan in plans) >= 2


async def test_a_robot_that_fails_again_and_again_is_lost_and_no_longer_commanded(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        stubborn = failing_team()
        stubborn.fails = staticmethod(lambda _: True)  # type: ignore[method-assign]
        driver = Driver(stubborn)
        assert await driver.drive(missions, record)
        log = parse_log((await missions.log(record)).encode())
        lost = [event for event in log.events if isinstance(event, RobotLost)]
        assert "failed 3 times in a row: a chair" in {event.reason for event in lost}
        assert log.events[-1].status is Status.FAILED


async def test_a_mission_and_its_log_continue_when_the_map_changes(tmp_path: Path) -> None:
    async with open_missions(tmp_path) as missions:
        record = await started(missions)
        driver = Driver(team())
        assert not await driver.drive(missions, record, 12)
        cells = (await missions.known(record)).cells.copy()
        y, x = (int(axis[0]) for axis in (cells == 1).nonzero())

        def changed(report: dict[str, Any]) -> dict[str, Any]:
            for seen in report.pop("revealed"):
                indices, codes = cells_in(tuple(seen["runs"]))
                cells.reshape(-1)[indices] = codes
            cells[y, x] = 0  # a new box
            return {**report, "map": {"runs": list(known_runs(cells))}}

        driver.edit = changed
        assert await driver.drive(missions, record)
        log = parse_log((await missions.log(record)).encode())
        assert [type(event) for event in log.events].count(MissionStarted) == 1
        assert [event.runs for event in log.events if isinstance(event, Changed)] == [(y * cells.shape[1] + x, 1, 0)]
        assert log.events[-1].status is Status.COMPLETE
        revisions = [json.loads(data)["revision"] for _, kind, data in driver.events if kind == "commands"]
        assert revisions == sorted(revisions)


def test_a_cancelled_mission_ends_although_its_planning_time_has_not_passed() -> None:
    asked = brief_from(body() | {"planning_time": "charged"})

    def begun(hosted: Hosted, *decisions: str) -> MissionBatch:
        (due,) = (event for event in hosted.batch(PendingInput(input=None)).events if event.type == "commands")
        return hosted.batch(PendingInput(input=team().report(json.loads(due.data)), decisions=decisions))

    with Hosted(asked) as hosted:
        (decision,) = (json.loads(event.data) for event in begun(hosted).events if event.type == "decision")
    with Hosted(asked) as hosted:
        begun(hosted, json.dumps(decision | {"wall_s": 5.0}))
        last = hosted.batch(PendingInput(input=Control.CANCEL))
    assert last.over
    assert [event.type for event in last.events] == ["log", "end"], "no plan is made, and no command sent"
