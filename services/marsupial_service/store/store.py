"""The store: a database in which one thread of this server writes and two read."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any, TypeVar

from marsupial_service.store.engine import Connection, StoreBackend, StoreError
from marsupial_service.store.outage import Outage
from marsupial_service.store.transaction import Transaction
from marsupial_service.store.writer import Writer

# a long read leaves one thread for short ones
_READERS = 2

T = TypeVar("T")

# receives the topics with news; None where there may be news on any
TopicListener = Callable[[frozenset[str] | None], None]


class Store:
    """The store of a database, which it closes in the end. Raises StoreError if that can't be used."""

    def __init__(self, engine: StoreBackend) -> None:
        self._engine = engine
        self._listeners: list[TopicListener] = []
        try:
            self._writer = Writer(engine, self._notify)
        except BaseException:
            engine.close()
            raise
        self._readers = ThreadPoolExecutor(_READERS, "store-reader")
        self._own = threading.local()
        self._connections: list[Connection] = []
        self._outage = Outage("the store can't be read")
        engine.listen(self._notify)

    def write(self, write: Callable[[Transaction], T]) -> Future[T]:
        """Run `write` in the thread that writes; the future has its result or exception once that is on disk.

        It may be run more than once, if its transaction and another server's are in each other's way. Raises StoreError
        if the store is closed; in the future, if nothing could be stored.
        """
        return self._writer.write(write)

    def read(self, read: Callable[[Connection], T]) -> Future[T]:
        """Run `read` in a thread that reads, on what is committed at one moment. Raises StoreError as `write` does."""
        try:
            return self._readers.submit(self._read, read)
        except RuntimeError as error:
            raise StoreError("the store is closed", "the service is shutting down") from error

    @property
    def failures(self) -> dict[str, int]:
        """How often writing and reading have failed."""
        return {"write": self._writer.failures, "read": self._outage.failures}

    def checkpoint(self) -> bool:
        """Give back what commits have left behind on the disk; return False if somebody is in the way."""
        with suppress(*self._engine.errors):
            return self._engine.checkpoint()
        return False

    def disk_bytes(self) -> Future[int]:
        """Return how many bytes the store takes on disk. Raises StoreError as `read` does."""
        return self.read(self._engine.disk_bytes)

    def listen(self, listener: TopicListener) -> None:
        """Call `listener`, in any thread, after every commit of any server that has news."""
        self._listeners.append(listener)

    def close(self) -> None:
        """Commit pending writes, and release the database."""
        self._writer.close()
        self._readers.shutdown()
        for connection in self._connections:
            connection.close()
        self._engine.close()

    def _notify(self, topics: frozenset[str] | None) -> None:
        for listener in self._listeners:
            listener(topics)

    def _read(self, read: Callable[[Connection], Any]) -> Any:
        try:
            try:
                found = self._in_snapshot(read)
            except self._engine.interferences:  # this server was frozen or too slow, and its session was ended
                self._drop_connection()
                found = self._in_snapshot(read)
        except self._engine.errors as error:
            self._drop_connection()
            self._outage.begin(str(error))
            raise StoreError(
                f"the store can't be read: {error}", "the store can't be read; see the server log"
            ) from error
        self._outage.end()
        return found

    def _in_snapshot(self, read: Callable[[Connection], Any]) -> Any:
        connection = self._begin_reading()
        try:
            found = read(connection)
        except BaseException as error:
            if not isinstance(error, self._engine.errors):  # else ending it would fail too, and hide why
                connection.execute("COMMIT")
            raise
        connection.execute("COMMIT")
        return found

    def _begin_reading(self) -> Connection:
        """Begin to read, over another connection if the last one is broken: the database may have been away."""
        with suppress(*self._engine.errors):
            connection = self._connection()
            connection.execute(self._engine.begin_reading)
            return connection
        self._drop_connection()
        connection = self._connection()
        connection.execute(self._engine.begin_reading)
        return connection

    def _connection(self) -> Connection:
        found: Connection | None = getattr(self._own, "connection", None)
        if found is None:
            found = self._own.connection = self._engine.reader()
            self._connections.append(found)
        return found

    def _drop_connection(self) -> None:
        """Close the connection of this thread: it may be broken."""
        found: Connection | None = getattr(self._own, "connection", None)
        if found is not None:
            self._own.connection = None
            self._connections.remove(found)
            with suppress(*self._engine.errors):
                found.close()
