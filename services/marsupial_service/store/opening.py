"""Which database a store is in, by how its place is written."""

from __future__ import annotations

from pathlib import Path

from marsupial_service.store.engine import StoreBackend
from marsupial_service.store.errors import StoreError
from marsupial_service.store.sqlite import Sqlite
from marsupial_service.store.store import Store

SCHEMES = ("postgresql://", "postgres://")


def open_store(place: str | Path) -> Store:
    """Return the store in a folder, made if need be, or in the PostgreSQL database of an address.

    Raises StoreInUse if another server has the folder, StoreError if it can't be used.
    """
    return Store(engine_of(place))


def engine_of(place: str | Path, *, maintains: bool = False) -> StoreBackend:
    """Return the database of a place, for a server, or for whoever `maintains` it. Raises StoreError."""
    if not is_shared(place):
        return Sqlite(Path(place), maintains=maintains)
    try:
        from marsupial_service.store.postgres import Postgres  # psycopg is an extra
    except ImportError as error:
        raise StoreError(f"a PostgreSQL store needs: pip install 'marsupial[postgres]' ({error})") from error
    return Postgres(str(place))


def is_shared(place: str | Path) -> bool:
    """Say whether a place is a database that servers share, and no folder."""
    return str(place).startswith(SCHEMES)
