"""A connection for maintenance, also while servers use the store: it takes nothing up and makes no tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from marsupial_service.store.engine import Connection, StoreBackend
from marsupial_service.store.errors import StoreError
from marsupial_service.store.opening import engine_of
from marsupial_service.store.tables import missing
from marsupial_service.store.transaction import Transaction

T = TypeVar("T")


class MaintenanceConnection:
    """A connection to a store that is there. Raises StoreError if it has no tables, or those of another version."""

    def __init__(self, engine: StoreBackend, connection: Connection) -> None:
        self.engine = engine
        self.connection = connection
        if missing(engine.version(connection), engine.place):
            raise StoreError(f"{engine.place}: the store has no tables yet")

    def read(self, read: Callable[[Connection], T]) -> T:
        """Run `read` on what is committed at one moment."""
        self.connection.execute(self.engine.begin_reading)
        try:
            return read(self.connection)
        finally:
            self.connection.execute("COMMIT")

    def write(self, write: Callable[[Transaction], T]) -> T:
        """Run `write` in a transaction."""
        transaction = Transaction(self.engine, self.connection)
        with transaction.committed():
            return write(transaction)


@contextmanager
def maintained(place: str | Path) -> Iterator[MaintenanceConnection]:
    """Give the store of a folder or database that is there. Raises StoreError."""
    engine = engine_of(place, maintains=True)
    try:
        connection = engine.maintainer()
        try:
            yield MaintenanceConnection(engine, connection)
        finally:
            connection.close()
    except engine.errors as error:
        raise StoreError(f"{engine.place}: {error}") from error
