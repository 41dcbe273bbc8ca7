"""A connection for maintenance, also while servers use the store: it takes nothing up and makes no tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from marsupial_service.store.engine import Connection, StoreBackend
from marsupial_service.store.errors import StoreError
from marsupial_service.store.opening import engine_of
from marsupial_service.store.tables import VERSION
from marsupial_service.store.transaction import Transaction

T = TypeVar("T")


class MaintenanceConnection:
    """A connection to a store that is there, of any version up to this one.

    Attributes
    ----------
    version
        Of its tables.
    """

    def __init__(self, engine: StoreBackend, connection: Connection) -> None:
        self.engine = engine
        self.connection = connection
        self.version = engine.version(connection)
        if not 0 < self.version <= VERSION:
            what = "has no tables yet" if not self.version else f"has version {self.version}, this is for {VERSION}"
            raise StoreError(f"{engine.place}: the store {what}")

    def read(self, read: Callable[[Connection], T]) -> T:
        """Run `read` on what is committed at one moment."""
        self.connection.execute(self.engine.begin_reading)
        try:
            return read(self.connection)
        finally:
            self.connection.execute("COMMIT")

    def write(self, write: Callable[[Transaction], T]) -> T:
        """Run `write` in a transaction. Raises StoreError if the tables are of an earlier version."""
        if self.version != VERSION:
            raise StoreError(
                f"{self.engine.place}: the store has version {self.version}; 'marsupial serve store upgrade' makes it"
                f" version {VERSION}"
            )
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
