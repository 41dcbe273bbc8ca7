"""Open a store by its place, a folder or the address of a database: for a server, or for maintenance beside servers."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypeVar

from marsupial_service.store.engine import Connection, StoreBackend, StoreError, one_line
from marsupial_service.store.sqlite import Sqlite
from marsupial_service.store.store import Store
from marsupial_service.store.tables import creation_script
from marsupial_service.store.transaction import Transaction

T = TypeVar("T")

SCHEMES = ("postgresql://", "postgres://")


def open_store(place: str | Path) -> Store:
    """Return the store in a folder, created if necessary, or in the PostgreSQL database at an address.

    Raises StoreInUse if another server has the folder, StoreError if it can't be used.
    """
    return Store(engine_of(place))


def engine_of(place: str | Path, *, for_maintenance: bool = False) -> StoreBackend:
    """Return the database of a place, for a server or (`for_maintenance`) for maintenance. Raises StoreError."""
    if not is_shared(place):
        return Sqlite(Path(place), for_maintenance=for_maintenance)
    try:
        from marsupial_service.store.postgres import Postgres  # psycopg is an extra
    except ImportError as error:
        raise StoreError(f"a PostgreSQL store needs: pip install 'marsupial[postgres]' ({error})") from error
    return Postgres(str(place))


def is_shared(place: str | Path) -> bool:
    """Return whether a place is a database that servers share, not a folder."""
    return str(place).startswith(SCHEMES)


class MaintenanceConnection:
    """A connection to an existing store. Raises StoreError if it has no tables, or those of another version."""

    def __init__(self, engine: StoreBackend, connection: Connection) -> None:
        self.engine = engine
        self.connection = connection
        if creation_script(engine.version(connection), engine.place):
            raise StoreError(f"{engine.place}: the store has no tables yet")

    def read(self, read: Callable[[Connection], T]) -> T:
        """Run `read` on a snapshot of the committed data."""
        self.connection.execute(self.engine.begin_reading)
        try:
            return read(self.connection)
        finally:
            self.connection.execute("COMMIT")

    def write(self, write: Callable[[Transaction], T]) -> T:
        transaction = Transaction(self.engine, self.connection)
        with transaction.committed():
            return write(transaction)


@contextmanager
def open_for_maintenance(place: str | Path) -> Iterator[MaintenanceConnection]:
    """Open the existing store of a folder or database for maintenance. Raises StoreError."""
    engine = engine_of(place, for_maintenance=True)
    try:
        with closing(engine.maintainer()) as connection:
            yield MaintenanceConnection(engine, connection)
    except engine.errors as error:
        raise StoreError(f"{engine.place}: {one_line(error)}") from error
