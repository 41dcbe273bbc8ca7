"""Stores of version 2, filled as that version did, are brought up to date: in a folder and in a shared database."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

import pytest

from marsupial.errors import UsageError
from marsupial_service.entries.capacity import stored_bytes
from marsupial_service.entries.records import EventRecord
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.missions import packed
from marsupial_service.missions.table import MISSIONS, log
from marsupial_service.missions.values import Control, MissionReport, RobotUpdate, StoredEvent
from marsupial_service.operations import upkeep
from marsupial_service.schemas.words import EventType, MissionPhase
from marsupial_service.store import Store, StoreError, Transaction, kept, open_store, tables
from marsupial_service.store.opening import engine_of
from marsupial_service.store.sqlite import FILE

SCHEMA = (Path(__file__).parent / "schema_2.sql").read_text()
REPORT = MissionReport(
    n=1, t_ms=500, revealed=(("joey", (5, 2, 1)),), robots=(RobotUpdate(name="joey", free_at_ms=600),)
)
LINES = ('{"event":"mission"}', '{"event":"reveal","t_ms":500}')
EVENTS = (
    (0, "log", LINES[0]),
    (0, "commands", '{"revision":0,"commands":[]}'),
    (1, "log", LINES[1]),
    (1, "commands", '{"revision":1,"commands":[]}'),
    (2, "state", '{"state":"paused"}'),
)


def fill(tx: Transaction) -> None:
    head = {"owner": "me", "digest": b"d", "created_ms": 1}
    tx.insert("jobs", **head, id="j", planner="greedy", state="succeeded", queued_ms=1, finished_ms=9, events=1)
    tx.insert("payloads", job=1, source=b"source")
    tx.insert("events", job=1, seq=1, type="end", data="{}", at_ms=9)
    columns = {"name": "hall", "strategy": "temporal", "planner": "auto", "n": 1, "t_ms": 500, "inputs": 2}
    tx.insert("missions", **head, **columns, id="m", state="paused", turns=3, events=len(EVENTS))
    tx.insert("mission_briefs", mission=1, brief=kept.dumps("brief"))
    tx.insert("mission_inputs", mission=1, seq=1, digest=b"r", data=kept.dumps(REPORT), at_ms=2)
    tx.insert("mission_inputs", mission=1, seq=2, data=kept.dumps(Control.PAUSE), at_ms=3)
    for seq, (turn, kind, data) in enumerate(EVENTS, start=1):
        tx.insert("mission_events", mission=1, seq=seq, turn=turn, type=kind, data=data, at_ms=2)


@pytest.fixture
def old(place: str, monkeypatch: pytest.MonkeyPatch) -> str:
    with monkeypatch.context() as patch:
        patch.setattr(tables, "_STEPS", (SCHEMA,))
        patch.setattr(tables, "VERSION", 1)
        store = open_store(place)
        store.write(fill).result()
        number = "UPDATE marsupial SET version = 2" if "://" in place else "PRAGMA user_version = 2"
        store.write(lambda tx: tx.execute(number)).result()
        store.close()
    return place


def test_everything_is_found_and_goes_on(old: str) -> None:
    store = open_store(old)
    try:
        check(store)
    finally:
        store.close()


def check(store: Store) -> None:
    mission = store.read(lambda c: MISSIONS.existing(c, "m")).result()
    assert (mission.state, mission.inputs, mission.batches, mission.events) == (MissionPhase.PAUSED, 2, 3, 5)
    records = tuple(EventRecord(seq=i, type=EventType(e[1]), data=e[2]) for i, e in enumerate(EVENTS, start=1))
    for after in range(6):
        assert store.read(lambda c, a=after: MISSIONS.events(c, "m", a, 99).events).result() == records[after:]
    turns = [store.read(lambda c, t=turn: packed.events_of_batch(c, 1, t)).result() for turn in range(4)]
    assert turns == [tuple(StoredEvent(EventType(e[1]), e[2]) for e in EVENTS if e[0] == turn) for turn in range(4)]
    assert store.read(lambda c: log(c, mission)).result() == LINES
    report, wish = map(kept.loads, store.read(lambda c: packed.inputs_from(c, 1, 1, 9)).result())
    assert (repr(report), wish) == (repr(REPORT), Control.PAUSE)
    digests = store.read(lambda c: [digest for _, digest in packed.inputs_after(c, 1, 0)]).result()
    assert digests == [b"r", None]

    store.write(lambda tx: packed.add_events(tx, 1, {3: [StoredEvent(EventType.STATE, "{}")] * 2}, 4)).result()
    found = store.read(lambda c: MISSIONS.events(c, "m", 4, 99).events).result()
    assert [event.seq for event in found] == [5, 6, 7]
    assert store.read(lambda c: JOBS.events(c, "j", 0, 9).events).result()[0].data == "{}"
    assert 1200 < store.read(stored_bytes).result() < 2500


def test_the_command_says_what_it_did_and_doing_it_again_does_nothing(old: str) -> None:
    assert (upkeep.info(old).version, upkeep.info(old).stored_bytes) == (2, None)
    assert upkeep.upgrade(old) == (2, tables.VERSION)
    assert upkeep.upgrade(old) == (tables.VERSION, tables.VERSION)
    assert upkeep.info(old).rows["mission_events"] == len(EVENTS)


def test_nothing_is_removed_from_a_store_of_an_earlier_version(old: str) -> None:
    with pytest.raises(StoreError, match="'marsupial serve store upgrade' makes it version"):
        upkeep.retain(old, days=0, kept=None, now_ms=99)
    assert upkeep.info(old).rows["jobs"] == 1


def test_a_shared_store_is_not_changed_under_servers_of_an_earlier_version(old: str) -> None:
    if "://" not in old:
        pytest.skip("a folder has one server")
    engine = engine_of(old)
    connection = engine.reader()
    connection.execute("INSERT INTO servers VALUES ('other', extract(epoch FROM clock_timestamp()))")
    with pytest.raises(StoreError, match="servers of an earlier version use it"):
        open_store(old)
    assert upkeep.info(old).version == 2
    connection.execute("DELETE FROM servers")
    connection.close()
    assert upkeep.upgrade(old) == (2, tables.VERSION)


def test_the_schema_tested_from_is_the_one_that_upgrades_start_from(tmp_path: Path) -> None:
    def shape(script: str) -> list[tuple[str, str]]:
        connection = sqlite3.connect(":memory:")
        connection.executescript(script)
        rows = connection.execute("SELECT name, sql FROM sqlite_master WHERE sql NOT NULL ORDER BY name").fetchall()
        connection.close()
        return [(name, re.sub(r"\s+", " ", sql)) for name, sql in rows]

    assert shape(SCHEMA) == shape("".join(tables._STEPS[:2]))


def test_a_folder_without_a_store_is_an_error_and_stays_empty(tmp_path: Path) -> None:
    for act in (upkeep.info, upkeep.upgrade):
        with pytest.raises(StoreError, match="there is no store"):
            act(tmp_path)
    with pytest.raises(UsageError, match="--days, --kept"):
        upkeep.retain(tmp_path, days=None, kept=None, now_ms=0)
    (tmp_path / FILE).write_bytes(b"something else " * 100)
    with pytest.raises(StoreError, match="not a database"):
        upkeep.info(tmp_path)
