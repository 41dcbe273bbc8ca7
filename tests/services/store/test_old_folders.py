"""Data folders written before jobs and missions shared their tables' definition: `schema_1.sql` is what was in them."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from marsupial_service.entries.records import EventRecord, NewEntry
from marsupial_service.jobs import table as job_table
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.jobs.records import JobSettings
from marsupial_service.missions.table import MISSIONS
from marsupial_service.schemas.words import EventType, JobEventType, JobOutcome, JobState, MissionPhase
from marsupial_service.store import Store, open_store
from marsupial_service.store.sqlite import FILE

SCHEMA = (Path(__file__).parent / "schema_1.sql").read_text()
ROWS = """
INSERT INTO jobs VALUES (1, 'done', 'me', 'k', x'01', 'greedy', 1.0, NULL, 'succeeded', 'satisficing', '', 1, 1, 2, 9,
    10, 10, 11, 12, 13);
INSERT INTO payloads VALUES (1, NULL, x'', NULL, NULL);
INSERT INTO plans VALUES (1, 1, 10, '[10,0,0]', 1, 12, '[]', '');
INSERT INTO events VALUES (1, 1, 'plan', '{}', 12), (1, 2, 'end', '{}', 13);
INSERT INTO jobs VALUES (2, 'died', 'me', NULL, x'02', 'greedy', NULL, 7, 'running', NULL, '', 1, 0, 0, NULL,
    20, 20, 21, NULL, NULL);
INSERT INTO payloads VALUES (2, x'00', x'', NULL, NULL);
INSERT INTO missions VALUES (1, 'trip', 'me', NULL, x'03', 'hall', 'temporal', 'auto', 'paused', NULL, '', 3, 500, 2, 4,
    4, 1, 30, NULL);
INSERT INTO mission_events VALUES (1, 1, 2, 'state', '{"state":"paused"}', 31);
"""
SHAPES = "SELECT type, name, tbl_name FROM sqlite_master WHERE name NOT LIKE 'sqlite_%' ORDER BY name"


@pytest.fixture
def old(tmp_path: Path) -> Iterator[Store]:
    connection = sqlite3.connect(tmp_path / FILE)
    connection.executescript(f"{SCHEMA}{ROWS}PRAGMA user_version = 1;")
    connection.close()
    store = open_store(tmp_path)
    yield store
    store.close()


def shape(path: Path) -> dict[str, object]:
    """Return the tables with their columns, in whatever order, and the indexes with what they are made of."""
    connection = sqlite3.connect(path)
    found: dict[str, object] = {}
    for kind, name, owner in connection.execute(SHAPES).fetchall():
        rows = connection.execute(f"PRAGMA {kind}_info({name})").fetchall()
        if kind == "table":
            keys = connection.execute(f"PRAGMA foreign_key_list({name})").fetchall()
            found[name] = sorted(row[1:] for row in rows), keys
        else:
            (sql,) = connection.execute("SELECT sql FROM sqlite_master WHERE name = ?", (name,)).fetchone()
            found[name] = owner, sql
    connection.close()
    return found


def test_an_old_folder_becomes_like_a_new_one(tmp_path: Path) -> None:
    for name in ("old", "new"):
        (tmp_path / name).mkdir()
    connection = sqlite3.connect(tmp_path / "old" / FILE)
    connection.executescript(f"{SCHEMA}PRAGMA user_version = 1;")
    connection.close()
    for name in ("old", "new"):
        open_store(tmp_path / name).close()
    assert shape(tmp_path / "old" / FILE) == shape(tmp_path / "new" / FILE)


def test_what_an_old_folder_holds_is_found_followed_and_carried_on(old: Store) -> None:
    done = old.read(lambda c: JOBS.existing(c, "done")).result()
    assert (done.state, done.outcome, done.finished_at_ms) == (JobState.SUCCEEDED, JobOutcome.SATISFICING, 13)
    assert (done.makespan_ms, done.gap) == (10, pytest.approx(0.1))
    batch = old.read(lambda c: JOBS.events(c, "done", 1, 9)).result()
    assert (batch.events, batch.is_open) == ((EventRecord(seq=2, type=JobEventType.END, data="{}"),), False)
    key = NewEntry(id="new", owner="me", key="k", digest=b"\x01")
    assert old.write(lambda tx: JOBS.made_before(tx, key)).result() == "done"

    old.write(lambda tx: job_table.recover(tx, JobSettings(), 40)).result()
    claim = old.write(lambda tx: job_table.claim(tx, 41)).result()
    assert claim is not None
    assert (claim.id, claim.attempt, claim.budget.steps) == ("died", 2, 7)

    mission = old.read(lambda c: MISSIONS.existing(c, "trip")).result()
    assert (mission.state, mission.n, mission.t_ms, mission.batches) == (MissionPhase.PAUSED, 3, 500, 4)
    tell = {"state": "running"}
    old.write(lambda tx: MISSIONS.tell(tx, mission.number, EventType.STATE, json.dumps(tell), 50, batch=4)).result()
    found = old.read(lambda c: MISSIONS.events(c, "trip", 0, 9)).result()
    assert ([event.seq for event in found.events], found.is_open) == ([1, 2], True)
