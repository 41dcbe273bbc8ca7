"""The SQLite file: how connections to it are opened.

Write-ahead log, every commit on disk before it returns (`synchronous=FULL`), foreign keys held. Any process that
can write to the folder can make the workers run anything, as tasks are kept pickled: it is made for its owner alone.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path

from marsupial_service.store import tables
from marsupial_service.store.errors import StoreError

VERSION = 1
"""Of the tables, kept in the file."""

_BUSY_MS = 10_000
_LONGEST_LOG = 64 << 20


def open_for_writing(path: Path) -> sqlite3.Connection:
    """Open the file, made with its tables if it isn't there, for the one thread that writes.

    Raises StoreError if it can't be opened or made, or is of another version.
    """
    try:
        connection = _open(path)
        try:
            _prepare(connection, path)
        except BaseException:
            connection.close()
            raise
    except sqlite3.Error as error:
        raise StoreError(f"{path}: {error}") from error
    return connection


def open_for_reading(path: Path) -> sqlite3.Connection:
    """Open the file, which is there, for a thread that reads."""
    connection = _open(path)
    connection.execute("PRAGMA query_only = ON")
    return connection


def _open(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    connection.row_factory = sqlite3.Row
    connection.execute(f"PRAGMA busy_timeout = {_BUSY_MS}")
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")
    return connection


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version not in (0, VERSION):
        raise StoreError(f"{path}: its tables have version {version}, this is for version {VERSION}")
    connection.execute("PRAGMA auto_vacuum = INCREMENTAL")
    (mode,) = connection.execute("PRAGMA journal_mode = WAL").fetchone()
    if mode != "wal":
        raise StoreError(f"{path}: this file system can't hold a write-ahead log")
    connection.execute(f"PRAGMA journal_size_limit = {_LONGEST_LOG}")
    if version == 0:
        connection.executescript(f"BEGIN IMMEDIATE;{tables.TABLES}PRAGMA user_version = {VERSION};COMMIT;")
