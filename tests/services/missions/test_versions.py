"""Missions that another version of the service has begun, or one with other planners."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest
from mission_setup import Driver, body, open_missions, send, started, team
from support.missions.reference_missions import reference_log
from support.services.databases import PostgresServer
from support.waiting import wait_until_async

from marsupial_service.intake.missions import brief_of
from marsupial_service.missions import table
from marsupial_service.missions.codeversion import code_version
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.service import Missions
from marsupial_service.missions.values import Control, MissionBrief
from marsupial_service.schemas.enums import MissionPhase
from marsupial_service.schemas.missions import MissionBody
from marsupial_service.settings import ServiceLimits
from marsupial_service.store import Transaction, open_store, packing

OTHER = packing.pack(b"log {}")


async def begun(place: Path | str, driver: Driver, reports: int) -> str:
    """Return a mission of version "old" after some reports."""
    async with open_missions(place, version="old") as missions:
        record = await started(missions)
        assert not await driver.drive(missions, record, reports)
        return record.id


def change_first_batch(place: Path | str, changed: bytes) -> bytes:
    """Change the first stored batch, as if another version had produced it; return what it was."""
    which = "batch = 0 AND part = 0"

    def change(tx: Transaction) -> bytes:
        (data,) = tx.execute(f"SELECT data FROM mission_events WHERE {which}").fetchone()
        tx.execute(f"UPDATE mission_events SET data = ? WHERE {which}", (changed,))
        return bytes(data)

    store = open_store(place)
    try:
        return store.write(change).result()
    finally:
        store.close()


async def left(missions: Missions, mission: str) -> MissionRecord:
    """Return a mission once a server has left it."""
    found = [await missions.of("me", mission)]

    async def is_left() -> bool:
        found.append(await missions.of("me", mission))
        return bool(found[-1].reason)

    await wait_until_async(is_left)
    return found[-1]


async def test_another_version_that_repeats_what_is_stored_takes_over(place: str) -> None:
    driver = Driver(team())
    mission = await begun(place, driver, 4)
    async with open_missions(place, version="new") as missions:
        record = await missions.of("me", mission)
        assert await driver.drive(missions, record)
        record = await missions.of("me", mission)
        assert (record.version, record.status) == ("new", "complete")
        assert await missions.log(record) == reference_log("lobby")


async def test_another_version_that_would_answer_otherwise_leaves_the_mission_to_the_older_one(
    place: str, caplog: pytest.LogCaptureFixture
) -> None:
    driver = Driver(team())
    mission = await begun(place, driver, 4)
    before = change_first_batch(place, OTHER)
    async with open_missions(place, version="new") as missions:
        record = await left(missions, mission)
        assert (record.state, record.status, record.version) == (MissionPhase.RUNNING, None, "old")
        for word in ("begun by version old", "version new can't continue", "after input 0 gave a different result"):
            assert word in record.reason
        assert [one.levelname for one in caplog.records if one.msg.startswith("mission ")] == ["ERROR"]
        assert (await missions.read(lambda reader: table.counts(reader, 0)))["missions_left"] == 1
        batches = record.batches
        record = await send(missions, record, {"n": 5, "t_ms": record.t_ms})
        assert (record.n, record.batches) == (5, batches)
    change_first_batch(place, before)
    async with open_missions(place, version="old") as missions:
        await wait_until_async(lambda: answered(missions, mission, 6))
        record = await missions.of("me", mission)
        assert (record.state, record.reason) == (MissionPhase.RUNNING, "")


async def answered(missions: Missions, mission: str, batches: int) -> bool:
    return (await missions.of("me", mission)).batches == batches


async def test_an_older_server_takes_a_mission_that_a_newer_one_beside_it_has_left(postgres: PostgresServer) -> None:
    shared, driver = postgres.database(), Driver(team())
    mission = await begun(shared, driver, 4)
    before = change_first_batch(shared, OTHER)
    async with open_missions(shared, version="new") as newer:
        await left(newer, mission)
        change_first_batch(shared, before)
        async with open_missions(shared, version="old") as older:
            assert await driver.drive(newer, await newer.of("me", mission))
            assert await older.log(await older.of("me", mission)) == reference_log("lobby")


async def test_a_mission_whose_brief_can_not_be_read_is_left_and_holds_up_no_other(place: str) -> None:
    unreadable = await begun(place, Driver(team()), 2)
    driver = Driver(team())
    mission = await begun(place, driver, 2)
    store = open_store(place)
    change = "UPDATE mission_briefs SET brief = ? WHERE mission = (SELECT number FROM missions WHERE id = ?)"
    store.write(lambda tx: tx.execute(change, (packing.pack(b"{}"), unreadable))).result()
    store.close()
    async with open_missions(place, version="new") as missions:
        record = await left(missions, unreadable)
        assert record.reason.startswith("this server can't read its brief")
        for _ in range(2):  # the second time it has been cancelled
            record = await missions.control(record, Control.CANCEL, "key")
            assert (record.state, record.status) == (MissionPhase.ENDED, "cancelled")
        assert await driver.drive(missions, await missions.of("me", mission))


async def test_a_mission_that_no_server_can_continue_can_be_cancelled(place: str) -> None:
    driver = Driver(team())
    mission = await begun(place, driver, 2)
    change_first_batch(place, OTHER)
    async with open_missions(place, version="new") as missions:
        record = await left(missions, mission)
        record = await missions.control(record, Control.CANCEL)
        assert (record.state, record.status) == (MissionPhase.ENDED, "cancelled")
        assert record.reason == "cancelled while no server could continue it"


def planned_by(name: str, commands: dict[str, str]) -> MissionBrief:
    asked = {**body(), "planner": name, "budget": {"seconds": 1.0}}
    return brief_of(MissionBody.model_validate(asked), ServiceLimits(), commands)


async def test_a_store_names_the_planner_and_each_server_knows_its_command(tmp_path: Path) -> None:
    first, second = ({"mine": f"cmd:{sys.executable} {word} {{domain}} {{problem}}"} for word in ("one", "two"))
    async with open_missions(tmp_path, commands=first) as missions:
        record, _ = await missions.create(planned_by("mine", first), b"", owner="me")
        stored = await missions.read(lambda reader: reader.execute("SELECT brief FROM mission_briefs").fetchone()[0])
        assert b"cmd:" not in packing.unpack(stored)
        assert b"mine" in packing.unpack(stored)
    async with open_missions(tmp_path) as missions:
        record = await left(missions, record.id)
        assert "planner mine" in record.reason
        assert record.state is MissionPhase.RUNNING
    async with open_missions(tmp_path, commands=second) as missions:
        await wait_until_async(lambda: answered(missions, record.id, 1))
        assert (await missions.of("me", record.id)).reason == ""


async def test_whoever_writes_to_the_store_runs_no_command(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    command = f"cmd:touch {trace} {{domain}} {{problem}}"
    wanted = replace(planned_by("greedy", {}), planner=command)
    async with open_missions(tmp_path / "data") as missions:
        record, _ = await missions.create(wanted, b"", owner="me")
        record = await left(missions, record.id)
        assert "must be the name of a planner, not a command line" in record.reason
    assert not trace.exists()


def test_the_version_names_the_release_and_the_sources() -> None:
    number, _, digest = code_version().partition("+")
    assert number
    assert len(digest) == 8
