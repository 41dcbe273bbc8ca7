"""Servers during an outage of their database, and after its return, miss nothing."""

import json
import logging
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import cast

import psycopg
import pytest
from mission_setup import run
from service_requests import client, problem
from support.services.databases import PostgresServer, postgres_server
from support.services.servers import Server
from support.waiting import wait_until, wait_until_async

from marsupial_service.entries.records import EventRecord
from marsupial_service.http.events import NO_STORE, _frames
from marsupial_service.jobs.service import Jobs
from marsupial_service.keys import KeyRow
from marsupial_service.schemas.enums import JobEventType
from marsupial_service.store import Store, StoreError, open_store


@pytest.fixture
def database() -> Iterator[PostgresServer]:
    """A database server that tests may kill."""
    with postgres_server("fsync=off") as found:
        yield found


def broken(store: Store) -> None:
    """Let the database close all connections of a store."""
    sql = (
        "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = ? AND pid != pg_backend_pid()"
    )
    store.write(lambda tx: tx.execute(sql, (f"marsupial {store._engine.server[:8]}",)).fetchall()).result()


def test_broken_connections_are_reopened(shared: str) -> None:
    store = open_store(shared)
    try:
        store.read(lambda reader: reader.execute("SELECT 1").fetchone()).result()
        broken(store)
        assert store.read(lambda reader: reader.execute("SELECT 2").fetchone()[0]).result() == 2
        assert store.write(lambda tx: tx.execute("SELECT 3").fetchone()[0]).result() == 3
    finally:
        store.close()


def test_a_server_receives_key_changes_and_renews_its_lease_despite_a_failed_read(
    shared: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, other = open_store(shared), open_store(shared)
    try:
        keys, theirs = KeyRow(store), KeyRow(other)
        failures = [StoreError("away")]
        read = KeyRow._read

        def fails_once(self: KeyRow) -> None:
            if self is keys and failures:
                raise failures.pop()
            read(self)

        monkeypatch.setattr(KeyRow, "_read", fails_once)
        secret = theirs.add("fleet", ["plan"], 1.0, 1000.0)

        async def heard() -> None:
            await wait_until_async(lambda: keys.find(secret, 1001.0))

        run(heard())
        assert not failures
    finally:
        store.close()
        other.close()


def test_no_server_loses_its_lease_during_an_outage_of_the_database(database: PostgresServer) -> None:
    store = open_store(database.database())
    try:
        store.write(lambda tx: tx.execute("INSERT INTO servers VALUES ('unheard', 0)")).result()
        live = store.write(lambda tx: {row["id"] for row in tx.execute(tx.live)}).result()
        assert live == {"unheard", store._engine.server}
    finally:
        store.close()


def test_a_database_that_is_read_only_for_a_while_is_logged_once_when_it_begins_and_once_when_it_ends(
    shared: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, "marsupial.store")
    monkeypatch.setattr("marsupial_service.store.postgres._RETRY_S", 0.01)
    listens: list[object] = []
    store = open_store(shared)
    store.listen(lambda topics: listens.append(topics))
    change = "UPDATE servers SET beat_s = beat_s"
    with psycopg.connect(shared, autocommit=True) as operator:
        (name,) = cast("tuple[str]", operator.execute("SELECT current_database()").fetchone())
        operator.execute(f"ALTER DATABASE {name} SET default_transaction_read_only = on".encode())
        sql = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE starts_with(application_name, 'marsupial ')"
        operator.execute(sql.encode())
        wait_until(lambda: len(listens) > 4)
        for attempt in (change, "SELECT 1", change):  # a write that changes nothing does not end the outage
            with pytest.raises(StoreError):
                store.write(lambda tx, sql=attempt: tx.execute(sql)).result()  # type: ignore[misc]
        operator.execute("SET default_transaction_read_only = off")
        (before,) = cast("tuple[datetime]", operator.execute("SELECT clock_timestamp()").fetchone())
        operator.execute(f"ALTER DATABASE {name} SET default_transaction_read_only = off".encode())
        # not those that began since: they may write, and their end would be another outage
        operator.execute(f"{sql} AND backend_start < %s".encode(), (before,))
    wait_until(lambda: store_writes(store, change))
    wait_until(lambda: any("notifications: resolved" in one.getMessage() for one in caplog.records))
    store.close()
    assert sorted(one.getMessage() for one in caplog.records) == [
        "the database sends no notifications",
        "the database sends no notifications: resolved",
        "the store can't be written",
        "the store can't be written: resolved",
    ]


def store_writes(store: Store, sql: str) -> bool:
    with suppress(StoreError):
        store.write(lambda tx: tx.execute(sql)).result()
        return True
    return False


async def test_a_stream_that_can_not_be_read_ends_with_a_message() -> None:
    class Broken:
        stopping = False

        async def follow(self, entry: str, after: int) -> AsyncIterator[tuple[EventRecord, ...]]:
            yield (EventRecord(seq=after + 1, type=JobEventType.STATE, data="{}"),)
            raise StoreError("away")

    found = [part async for part in _frames(cast("Jobs", Broken()), "job", 4, lambda: True)]
    assert found[1:] == [b"id: 5\nevent: state\ndata: {}\n\n", NO_STORE]


def test_during_an_outage_requests_get_503_and_streams_end_and_then_all_continues(
    database: PostgresServer, tmp_path: Path
) -> None:
    with Server(tmp_path / "data", "--store", database.database()) as server, client(server) as http:
        job = {**http.get("/v1/demo-data/yard").json(), "planner": "anytime", "budget": {"seconds": 2}}
        made = http.post("/v1/jobs", json=job).json()["links"]
        wait_until(lambda: http.get(made["self"]).json()["best"])
        with http.stream("GET", made["events"]) as stream:
            lines = stream.iter_lines()
            next(lines)
            database.crash()
            for answer in (http.get(made["self"]), http.post("/v1/jobs", json=job), http.get(made["events"])):
                problem(answer, 503, "not-ready")
                assert int(answer.headers["retry-after"]) >= 1
            database.start()
            said = set(lines)
        while (now := http.get(made["self"])).status_code == 503 or now.json()["outcome"] is None:
            time.sleep(0.05)
        assert (now.json()["outcome"], now.json()["attempts"]) == ("satisficing", 1)
        assert said & {"event: end", NO_STORE.decode().strip()}
    records = [json.loads(line) for line in server.log.splitlines() if line.startswith("{")]
    assert [record for record in records if "traceback" in record] == []
    errors = [record["message"] for record in records if record["level"] == "error"]
    assert len(errors) <= 6, errors
