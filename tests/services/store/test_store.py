import logging
import os
import signal
import sqlite3
import subprocess
import sys
import threading
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from support.waiting import HANG_S

from benchmarks.trial import failpoints
from marsupial_service.store import Store, StoreError, StoreInUse, Transaction, open_store, packing
from marsupial_service.store.outage import Outage
from marsupial_service.store.packing import PIECE, joined, pack, split, unpack
from marsupial_service.store.sqlite import FILE

NEW = (
    "INSERT INTO jobs (id, owner, digest, planner, state, created_ms, queued_ms)"
    " VALUES (?, 'me', x'', '', 'queued', 0, 0)"
)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = open_store(tmp_path / "data")
    yield opened
    opened.close()


def adding(*names: str) -> Callable[[Transaction], None]:
    def write(tx: Transaction) -> None:
        for name in names:
            tx.execute(NEW, (name,))
            tx.news.add(name)

    return write


def names(store: Store) -> list[str]:
    return store.read(lambda c: [row[0] for row in c.execute("SELECT id FROM jobs ORDER BY id")]).result()


class Held:
    """Blocks the writer thread within a write, so that later writes form one group."""

    def __init__(self, store: Store) -> None:
        self._entered, self._go_on = threading.Event(), threading.Event()
        self.done = store.write(self._wait)
        assert self._entered.wait(HANG_S)

    def _wait(self, tx: Transaction) -> None:
        self._entered.set()
        assert self._go_on.wait(HANG_S)

    def release(self) -> None:
        self._go_on.set()
        self.done.result(HANG_S)


def test_writes_during_a_commit_share_the_next_commit(store: Store) -> None:
    commits: list[frozenset[str]] = []
    store.listen(commits.append)
    held = Held(store)
    writes = [store.write(adding(f"j{i:02}")) for i in range(50)]
    held.release()
    for write in writes:
        write.result(HANG_S)
    assert names(store) == [f"j{i:02}" for i in range(50)]
    assert len(commits) == 1


def test_a_failed_write_rolls_back_its_own_changes_only(store: Store) -> None:
    undone = []

    def refuse(tx: Transaction) -> None:
        tx.on_rollback.append(lambda: undone.append("refused"))
        tx.execute(NEW, ("half",))
        raise KeyError("no")

    held = Held(store)
    writes = [store.write(write) for write in (adding("a"), refuse, adding("b"), adding("a"), adding("c"))]
    held.release()
    errors = [type(write.exception(HANG_S)) for write in writes]
    assert errors == [type(None), KeyError, type(None), sqlite3.IntegrityError, type(None)]
    assert (names(store), undone) == (["a", "b", "c"], ["refused"])


def test_a_failing_listener_is_notified_again_and_stops_no_writes(place: str) -> None:
    store, told = open_store(place), list[frozenset[str] | None]()
    try:

        def listener(topics: frozenset[str] | None) -> None:
            told.append(topics)
            if topics is not None and "bad" in topics:
                raise ValueError("a listener failed")

        store.listen(listener)
        store.write(lambda tx: tx.news.add("bad")).result(HANG_S)
        store.write(lambda tx: tx.news.add("good")).result(HANG_S)
        store.write(lambda tx: None).result(HANG_S)
        assert None in told[told.index(frozenset({"bad"})) :]
    finally:
        store.close()


def test_on_a_full_disk_a_write_fails_clearly_without_effect(store: Store) -> None:
    store.write(adding("before")).result()
    pages = store.write(lambda tx: tx.execute("PRAGMA page_count").fetchone()[0]).result()
    store.write(lambda tx: tx.execute(f"PRAGMA max_page_count = {pages + 2}").fetchall()).result()
    with pytest.raises(StoreError, match="nothing was stored: database or disk is full"):
        store.write(adding(*(f"{i:0500}" for i in range(200)))).result()
    assert names(store) == ["before"]
    store.write(lambda tx: tx.execute("PRAGMA max_page_count = 100000").fetchall()).result()
    store.write(adding("after")).result()
    assert names(store) == ["after", "before"]


def test_a_failed_commit_raises_for_every_write_of_its_group(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    failpoints.arm("before_commit=disk_full@2")
    held = Held(store)
    writes = [store.write(adding(name)) for name in "abc"]
    held.release()
    assert all(isinstance(write.exception(HANG_S), StoreError) for write in writes)
    assert names(store) == []
    store.write(adding("d")).result()
    assert names(store) == ["d"]
    store.close()


def test_a_read_sees_one_moment(store: Store) -> None:
    def read(connection: sqlite3.Connection) -> list[int]:
        first = connection.execute("SELECT count(*) FROM jobs").fetchone()[0]
        store.write(adding("meanwhile")).result(HANG_S)
        return [first, connection.execute("SELECT count(*) FROM jobs").fetchone()[0]]

    assert store.read(read).result() == [0, 0]
    assert names(store) == ["meanwhile"]


def test_a_read_can_not_write(store: Store) -> None:
    with pytest.raises(StoreError, match="readonly"):
        store.read(lambda connection: connection.execute(NEW, ("a",))).result()


def test_a_closed_store_raises(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    store.close()
    with pytest.raises(StoreError, match="closed"):
        store.write(adding("a"))
    with pytest.raises(StoreError, match="closed"):
        store.read(lambda connection: None)


def test_writes_that_wait_when_the_store_is_closed_are_committed(tmp_path: Path) -> None:
    store = open_store(tmp_path)
    held = Held(store)
    write = store.write(adding("late"))
    closing = threading.Thread(target=store.close)
    closing.start()
    held.release()
    closing.join(HANG_S)
    assert write.result(HANG_S) is None
    again = open_store(tmp_path)
    assert names(again) == ["late"]
    again.close()


def test_a_second_server_is_refused_while_the_first_one_has_the_folder(tmp_path: Path) -> None:
    first = open_store(tmp_path)
    with pytest.raises(StoreInUse, match=rf"in use by another server \(process {os.getpid()}\)"):
        open_store(tmp_path)
    first.close()
    open_store(tmp_path).close()


def test_an_invalid_folder_or_database_is_an_error_and_releases_the_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="file"):
        open_store(tmp_path / "file" / "data")
    (tmp_path / "marsupial.sqlite").write_bytes(b"something else entirely" * 100)
    for _ in range(2):
        with pytest.raises(StoreError, match="not a database"):
            open_store(tmp_path)


def test_a_commit_is_on_disk_before_it_is_acknowledged(store: Store) -> None:
    settings = store.write(
        lambda tx: [tx.execute(f"PRAGMA {name}").fetchone()[0] for name in ("journal_mode", "synchronous")]
    ).result()
    assert settings == ["wal", 2]


@pytest.mark.parametrize(
    ("armed", "stored"),
    [("before_commit=kill@2", ["a"]), ("after_commit=kill@2", ["a", "b"]), ("before_commit=kill", [])],
)
def test_killed_at_a_commit_the_file_holds_all_of_it_or_nothing(tmp_path: Path, armed: str, stored: list[str]) -> None:
    code = (
        "import sys; from pathlib import Path; sys.path[:] = eval(sys.argv[2])\n"
        "from marsupial_service.store import open_store\n"
        "from test_store import adding, failpoints\n"
        "failpoints.arm(sys.argv[3]); store = open_store(Path(sys.argv[1]))\n"
        "for name in 'abc': store.write(adding(name)).result(); print(name, flush=True)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path), repr([str(Path(__file__).parent), *sys.path]), armed],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    store = open_store(tmp_path)
    assert names(store) == stored
    store.close()
    acknowledged = done.stdout.split()
    assert set(acknowledged) <= set(stored)


def test_the_database_is_readable_by_its_owner_only(tmp_path: Path) -> None:
    folder = tmp_path / "open"
    folder.mkdir(mode=0o755)
    (folder / FILE).touch(mode=0o644)  # as left by an earlier version
    before = os.umask(0)
    try:
        store = open_store(folder)
        store.write(adding("one")).result()
        modes = {file.name: file.stat().st_mode & 0o777 for file in folder.glob(f"{FILE}*")}
        store.close()
    finally:
        os.umask(before)
    assert modes == {FILE: 0o600, f"{FILE}-wal": 0o600, f"{FILE}-shm": 0o600}


def test_a_failure_is_logged_at_its_start_and_its_end(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    outage = Outage("it is away")
    assert not outage.end()
    for reason in ("first", "second"):
        outage.begin(reason)
        outage.begin(reason)
        assert outage.end()
        assert not outage.end()
    assert [record.getMessage() for record in caplog.records] == ["it is away", "it is away: resolved"] * 2
    assert [getattr(record, "reason", None) for record in caplog.records] == ["first", None, "second", None]


LINE = b'log {"event":"reveal","t_ms":68934,"robot":"carrier1","cells":[5812,3,1,57,4,1,56,5,1]}'


@pytest.mark.parametrize("data", [b"x", LINE, os.urandom(5000), LINE * 2000, "\u00e9\u2028".encode()])
def test_packed_data_is_unpacked(data: bytes) -> None:
    assert unpack(pack(data)) == data
    assert data != LINE or len(pack(data)) < len(data) / 2


def test_the_dictionary_is_the_one_that_stored_rows_were_packed_with() -> None:
    assert zlib.crc32(packing._DICTIONARY_1) == 420693663
    packed = bytes.fromhex("01c3573f9922524f567e6aa5522d00")
    assert unpack(packed) == b'log {"event":"stand","t_ms":5,"robot":"joey"}'


def test_parts_are_joined_in_their_order() -> None:
    values = [pack(os.urandom(size)) for size in (10, PIECE - 1, PIECE, 3 * PIECE + 1)]
    rows = [{"seq": i, "part": part, "data": data} for i, one in enumerate(values) for part, data in split(one)]
    assert max(len(row["data"]) for row in rows) == PIECE
    assert [(row["seq"], data) for row, data in joined(rows)] == [(i, unpack(one)) for i, one in enumerate(values)]
    assert list(joined([])) == []
