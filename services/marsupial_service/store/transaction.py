"""A transaction: begun, committed and rolled back in one place."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from marsupial_service.store.engine import Connection, StoreBackend, StoreRows


class Transaction:
    """The transaction that a write gets."""

    def __init__(self, engine: StoreBackend, connection: Connection) -> None:
        self._engine = engine
        self._connection = connection
        self.server = engine.server
        self.row_lock = engine.row_lock
        self.skip_locked = engine.skip_locked
        self.live = engine.live
        self.news: set[str] = set()  # topics whose subscribers are notified after the commit
        self.on_rollback: list[Callable[[], None]] = []  # called if the write that appends is not stored
        # the rollback failed as well, so the connection is useless; and it did before the commit was sent
        self.is_broken = self.is_lost = False

    @contextmanager
    def committed(self) -> Iterator[None]:
        """Begin a transaction before the block; commit it and notify of its news after; roll back on any exception."""
        engine, connection = self._engine, self._connection
        is_begun = is_ending = False
        try:
            connection.execute(engine.begin)
            is_begun = True
            yield
            if self.news:
                engine.notify(connection, frozenset(self.news))
            is_ending = True
            connection.execute("COMMIT")
        except BaseException as error:
            # before the rollback: if that fails as well, caches must not keep what was not stored
            self.roll_back()
            try:
                connection.execute("ROLLBACK")
            except engine.errors:  # none was begun, or the connection is gone
                self.is_broken = True
                self.is_lost = not is_begun or (isinstance(error, engine.breaks) and not is_ending)
            raise

    def roll_back(self, first: int = 0) -> None:
        """Run the callbacks in `on_rollback` from the `first` on, the latest first."""
        while len(self.on_rollback) > first:
            self.on_rollback.pop()()

    def execute(self, sql: str, values: Iterable[Any] = ()) -> StoreRows:
        return self._connection.execute(sql, tuple(values))

    def insert(self, table: str, **columns: Any) -> None:
        places = ", ".join("?" * len(columns))
        self.execute(f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({places})", columns.values())

    def lock(self, name: str) -> None:
        """Wait until no other server is between here and the end of a transaction with the same `name`."""
        self._engine.lock(self._connection, name)

    def shrink(self) -> bool:
        """Free some unused space; return whether there is more."""
        return self._engine.shrink(self._connection)


StoreReader = Connection | Transaction
