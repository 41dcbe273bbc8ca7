"""The embedded database: one SQLite file in a folder that one server has to itself.

Write-ahead log, every commit on disk before it returns (`synchronous=FULL`), foreign keys held. Any process that
can write to the folder can make the workers run anything, as tasks are kept pickled: it is made for its owner alone.
"""

from __future__ import annotations

import os
import sqlite3
import uuid
from collections.abc import Callable
from pathlib import Path

from marsupial_service.store import lock, tables
from marsupial_service.store.engine import Connection
from marsupial_service.store.errors import StoreError

FILE = "marsupial.sqlite"

_BUSY_MS = 10_000
_LONGEST_LOG = 64 << 20
_FREED_PAGES = 2000


class Sqlite:
    """The file in `folder`, which is made if need be. Raises StoreInUse, StoreError."""

    begin = "BEGIN IMMEDIATE"
    begin_reading = "BEGIN"
    row_lock = skip_locked = ""
    live = "SELECT id FROM servers"
    errors: tuple[type[Exception], ...] = (sqlite3.Error,)
    refusals: tuple[type[Exception], ...] = (sqlite3.IntegrityError, sqlite3.ProgrammingError)

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        self.place = str(self.path)
        self.server = uuid.uuid4().hex
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{folder}: {error.strerror}") from error
        self._lock = lock.take(folder / "lock")

    def writer(self) -> sqlite3.Connection:
        """Open the file, made with its tables if it isn't there, for the one thread that writes.

        Raises StoreError if it can't be opened or made, or is of a later version.
        """
        try:
            connection = self._open()
            try:
                self._prepare(connection)
            except BaseException:
                connection.close()
                raise
        except sqlite3.Error as error:
            raise StoreError(f"{self.path}: {error}") from error
        return connection

    def reader(self) -> sqlite3.Connection:
        """Open the file, which is there, for a thread that reads."""
        connection = self._open()
        connection.execute("PRAGMA query_only = ON")
        return connection

    def clashed(self, error: BaseException) -> bool:
        """Say no: there are no others."""
        return False

    def lock(self, connection: Connection, name: str) -> None:
        """Do nothing: there are no others."""

    def tell(self, connection: Connection, topics: frozenset[str]) -> None:
        """Do nothing: there are no others."""

    def listen(self, heard: Callable[[frozenset[str] | None], None]) -> None:
        """Do nothing: there are no others."""

    def shrink(self, connection: Connection) -> None:
        """Give free pages at the end of the file back, some at a time."""
        connection.execute(f"PRAGMA incremental_vacuum({_FREED_PAGES})").fetchall()

    def close(self) -> None:
        """Let go of the folder."""
        os.close(self._lock)

    def _open(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self.path, isolation_level=None, check_same_thread=False)
        connection.row_factory = sqlite3.Row
        connection.execute(f"PRAGMA busy_timeout = {_BUSY_MS}")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection

    def _prepare(self, connection: sqlite3.Connection) -> None:
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        steps = tables.steps(version, self.place)
        connection.execute("PRAGMA auto_vacuum = INCREMENTAL")
        (mode,) = connection.execute("PRAGMA journal_mode = WAL").fetchone()
        if mode != "wal":
            raise StoreError(f"{self.path}: this file system can't hold a write-ahead log")
        connection.execute(f"PRAGMA journal_size_limit = {_LONGEST_LOG}")
        if steps:
            script = "".join(steps)
            connection.executescript(f"BEGIN IMMEDIATE;{script}PRAGMA user_version = {tables.VERSION};COMMIT;")
        connection.execute("DELETE FROM servers WHERE id != ?", (self.server,))
        connection.execute("INSERT INTO servers VALUES (?, 0) ON CONFLICT DO NOTHING", (self.server,))
