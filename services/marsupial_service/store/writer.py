"""The one thread that writes, and commits in groups.

Whatever waits while one commit is on its way to the disk becomes the next group. A write is told that it is done after
its commit, so that what is acknowledged is on disk. A write that refuses (raises) takes back its own changes only; if
the disk fails, the whole group is taken back and every caller in it is told.
"""

from __future__ import annotations

import queue
import sqlite3
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from typing import Any

from marsupial_service.store import failpoints
from marsupial_service.store.errors import StoreError

_LARGEST_GROUP = 256
_REFUSALS = (sqlite3.IntegrityError, sqlite3.ProgrammingError)


class Transaction:
    """What a write works with; `news` are the topics whose followers are to be told after the commit."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        self.news: set[str] = set()

    def execute(self, sql: str, values: Iterable[Any] = ()) -> sqlite3.Cursor:
        """Run one statement."""
        return self._connection.execute(sql, tuple(values))

    def insert(self, table: str, **columns: Any) -> int:
        """Add a row to a table, and return its number."""
        places = ", ".join("?" * len(columns))
        sql = f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({places})"
        return self.execute(sql, columns.values()).lastrowid or 0


class _Errand:
    def __init__(self, write: Callable[[Transaction], Any]) -> None:
        self.write = write
        self.future: Future[Any] = Future()
        self.result: Any = None
        self.refusal: Exception | None = None

    def run(self, transaction: Transaction) -> None:
        """Do it; its changes are taken back if it refuses."""
        transaction.execute("SAVEPOINT errand")
        try:
            self.result = self.write(transaction)
        except Exception as error:
            if isinstance(error, sqlite3.Error) and not isinstance(error, _REFUSALS):
                raise
            self.refusal = error
            transaction.execute("ROLLBACK TO errand")
        transaction.execute("RELEASE errand")

    def tell(self) -> None:
        """Tell its result, once committed."""
        if self.refusal is None:
            self.future.set_result(self.result)
        else:
            self.future.set_exception(self.refusal)


class Writer:
    """The thread; `tell` is called in it after every commit, with the topics that have news."""

    def __init__(
        self,
        connection: sqlite3.Connection,
        points: failpoints.Failpoints,
        tell: Callable[[frozenset[str]], None],
    ) -> None:
        self._connection = connection
        self._points = points
        self._tell = tell
        self._errands: queue.SimpleQueue[_Errand | None] = queue.SimpleQueue()
        self._closed = False
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="store-writer", daemon=True)
        self._thread.start()

    def write(self, write: Callable[[Transaction], Any]) -> Future[Any]:
        """Have a write done; the result comes after its commit. Raises StoreError as `Store.write` says."""
        errand = _Errand(write)
        with self._lock:
            if self._closed:
                raise StoreError("the store is closed")
            self._errands.put(errand)
        return errand.future

    def close(self) -> None:
        """Do what waits, then end."""
        with self._lock:
            self._closed = True
            self._errands.put(None)
        self._thread.join()
        self._connection.close()

    def _run(self) -> None:
        while (first := self._errands.get()) is not None:
            group, last = [first], False
            while len(group) < _LARGEST_GROUP and not last and not self._errands.empty():
                errand = self._errands.get()
                if errand is None:
                    last = True
                else:
                    group.append(errand)
            self._do([errand for errand in group if errand.future.set_running_or_notify_cancel()])
            if last:
                return

    def _do(self, group: list[_Errand]) -> None:
        transaction = Transaction(self._connection)
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            for errand in group:
                errand.run(transaction)
            self._points.reach(failpoints.BEFORE_COMMIT)
            self._connection.execute("COMMIT")
        except BaseException as error:
            self._fail(group, error)
            return
        self._points.reach(failpoints.AFTER_COMMIT)
        for errand in group:
            errand.tell()
        if transaction.news:
            self._tell(frozenset(transaction.news))

    def _fail(self, group: list[_Errand], error: BaseException) -> None:
        if self._connection.in_transaction:
            self._connection.execute("ROLLBACK")
        for errand in group:
            told = StoreError(f"nothing was stored: {error}")
            told.__cause__ = error
            errand.future.set_exception(told)
