"""The store: a folder with one SQLite file, locked by one server; one thread writes, two read."""

from __future__ import annotations

import os
import sqlite3
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

from marsupial_service.store import database, lock
from marsupial_service.store.errors import StoreError
from marsupial_service.store.failpoints import failpoints
from marsupial_service.store.writer import Transaction, Writer

FILE = "marsupial.sqlite"
_READERS = 2

T = TypeVar("T")


class Store:
    """The store in `folder`, which is made if need be. Raises StoreInUse, StoreError."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        points = failpoints(os.environ)
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{folder}: {error.strerror}") from error
        self._lock = lock.take(folder / "lock")
        self._listeners: list[Callable[[frozenset[str]], None]] = []
        try:
            connection = database.open_for_writing(self.path)
        except BaseException:
            os.close(self._lock)
            raise
        self._writer = Writer(connection, points, self._tell)
        self._readers = ThreadPoolExecutor(_READERS, "store-reader")
        self._own = threading.local()
        self._connections: list[sqlite3.Connection] = []

    def write(self, write: Callable[[Transaction], T]) -> Future[T]:
        """Run `write` in the thread that writes; the future has its result or exception once that is on disk.

        Raises StoreError if the store is closed; in the future, if nothing could be stored.
        """
        return self._writer.write(write)

    def read(self, read: Callable[[sqlite3.Connection], T]) -> Future[T]:
        """Run `read` in a thread that reads, on what is committed at one moment. Raises StoreError as `write` does."""
        try:
            return self._readers.submit(self._read, read)
        except RuntimeError as error:
            raise StoreError("the store is closed") from error

    def listen(self, listener: Callable[[frozenset[str]], None]) -> None:
        """Have `listener` called after every commit that has news, with their topics, by the thread that writes."""
        self._listeners.append(listener)

    def close(self) -> None:
        """Commit what is under way, and let go of the folder."""
        self._writer.close()
        self._readers.shutdown()
        for connection in self._connections:
            connection.close()
        os.close(self._lock)

    def _tell(self, topics: frozenset[str]) -> None:
        for listener in self._listeners:
            listener(topics)

    def _read(self, read: Callable[[sqlite3.Connection], Any]) -> Any:
        try:
            connection = self._connection()
            connection.execute("BEGIN")
            try:
                return read(connection)
            finally:
                connection.execute("COMMIT")
        except sqlite3.Error as error:
            raise StoreError(f"nothing can be read: {error}") from error

    def _connection(self) -> sqlite3.Connection:
        found: sqlite3.Connection | None = getattr(self._own, "connection", None)
        if found is None:
            found = self._own.connection = database.open_for_reading(self.path)
            self._connections.append(found)
        return found
