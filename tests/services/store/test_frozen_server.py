"""A server that freezes within a transaction: others continue, and it writes again when it wakes."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any

import psycopg
import pytest
from support.services.databases import PostgresServer
from support.waiting import HANG_S, wait_until

from marsupial_service.store import Store, Transaction, open_store
from marsupial_service.store import postgres as postgres_store
from marsupial_service.store.engine import Connection
from marsupial_service.store.opening import open_for_maintenance


@pytest.fixture
def servers(postgres: PostgresServer) -> Iterator[tuple[Store, Store]]:
    url = postgres.database()
    frozen, healthy = open_store(url), open_store(url)
    yield frozen, healthy
    frozen.close()
    healthy.close()


class Freeze:
    """Simulates a SIGSTOP between two statements: its first call waits until `wake`."""

    def __init__(self) -> None:
        self.reached, self._woken = threading.Event(), threading.Event()

    def __call__(self) -> None:
        if not self.reached.is_set():
            self.reached.set()
            assert self._woken.wait(HANG_S)

    def wake(self) -> None:
        self._woken.set()


def insert(tx: Transaction, name: str) -> None:
    tx.execute("INSERT INTO owners VALUES (?, 1) ON CONFLICT (name) DO UPDATE SET served = owners.served + 1", (name,))


def insert_locked(tx: Transaction, name: str) -> None:
    tx.lock("shared")
    insert(tx, name)


def served(store: Store) -> dict[str, int]:
    return store.read(lambda c: {row["name"]: row["served"] for row in c.execute("SELECT * FROM owners")}).result()


def test_locks_of_a_frozen_server_are_released_and_it_writes_once_when_it_wakes(servers: tuple[Store, Store]) -> None:
    frozen, healthy = servers
    freeze = Freeze()

    def halfway(tx: Transaction) -> None:
        insert_locked(tx, "both")
        freeze()
        insert(tx, "frozen")

    stuck = frozen.write(halfway)
    assert freeze.reached.wait(HANG_S)
    healthy.write(partial(insert_locked, name="both")).result(HANG_S)  # while the other server is still frozen
    assert served(healthy) == {"both": 1}
    freeze.wake()
    stuck.result(HANG_S)
    assert served(healthy) == {"both": 2, "frozen": 1}


MEGABYTES = 40
AMID = {
    "a statement": (b"SELECT length($1::bytea)", [bytes(MEGABYTES << 20)]),
    "its rows": (b"SELECT repeat('x', 1 << 20) FROM generate_series(1, $1::int)", [str(MEGABYTES).encode()]),
}


@pytest.mark.parametrize("amid", AMID)
def test_a_server_that_froze_amid_a_statement_or_its_rows_is_ended_when_another_waits(
    servers: tuple[Store, Store], amid: str
) -> None:
    frozen, healthy = servers
    freeze = Freeze()
    sql, values = AMID[amid]

    def halfway(tx: Transaction) -> None:
        tx.lock("shared")
        if not freeze.reached.is_set():
            wire: Any = tx._connection.pgconn  # type: ignore[attr-defined]
            wire.nonblocking = 1
            wire.send_query_params(sql, values)
            wire.flush()  # fills the buffers; the rest is not sent, and the answer is not read
            freeze()
            raise psycopg.OperationalError("the connection is closed")
        insert(tx, "frozen")

    stuck = frozen.write(halfway)
    assert freeze.reached.wait(HANG_S)
    healthy.write(partial(insert_locked, name="healthy")).result(HANG_S)
    assert served(healthy) == {"healthy": 1}
    freeze.wake()
    stuck.result(HANG_S)
    assert served(healthy) == {"healthy": 1, "frozen": 1}


def test_a_read_that_was_frozen_is_read_again(servers: tuple[Store, Store], postgres: PostgresServer) -> None:
    frozen, healthy = servers
    freeze = Freeze()

    def halfway(connection: Connection) -> int:
        connection.execute("SET idle_in_transaction_session_timeout = '10ms'")  # instead of waiting for the lease
        freeze()
        return int(connection.execute("SELECT count(*) FROM owners").fetchone()[0])

    stuck = frozen.read(halfway)
    assert freeze.reached.wait(HANG_S)
    healthy.write(lambda tx: insert(tx, "later")).result(HANG_S)
    _until_ended(healthy)
    freeze.wake()
    assert stuck.result(HANG_S) == 1


def _until_ended(store: Store) -> None:
    """Wait until no session is idle in a transaction any more."""
    sql = "SELECT count(*) FROM pg_stat_activity WHERE state = 'idle in transaction' AND pid != pg_backend_pid()"
    while store.write(lambda tx: tx.execute(sql).fetchone()[0]).result(HANG_S):
        pass


def bounds(tx: Transaction) -> list[str]:
    settings = "idle_in_transaction_session_timeout", "lock_timeout", "statement_timeout"
    return [tx.execute(f"SHOW {name}").fetchone()[0] for name in settings]


def test_every_connection_that_writes_bounds_what_it_can_hold_up(postgres: PostgresServer) -> None:
    url = postgres.database()
    store = open_store(url)
    try:
        assert store.write(bounds).result(HANG_S) == ["2s", "4s", "1min"]
        with open_for_maintenance(url) as connection:
            assert connection.write(bounds) == ["2s", "4s", "1min"]
    finally:
        store.close()


def test_a_server_waits_until_another_one_has_brought_the_tables_up_to_date(
    postgres: PostgresServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = postgres.database()
    open_store(url).close()
    monkeypatch.setattr(postgres_store, "_LOCK_S", 0.01)  # instead of waiting longer
    waits = "SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND NOT granted"
    with psycopg.connect(url) as upgrading, ThreadPoolExecutor(1) as threads:
        upgrading.execute("SELECT pg_advisory_xact_lock(%s)", (postgres_store._PREPARING,))
        coming = threads.submit(open_store, url)
        wait_until(lambda: coming.done() or upgrading.execute(waits).fetchone() == (1,))
        with suppress(TimeoutError):
            coming.result(0.1)
        assert not coming.done()
        upgrading.rollback()
        coming.result(HANG_S).close()
