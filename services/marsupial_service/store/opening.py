"""Which database a store is in, by how its place is written."""

from __future__ import annotations

from pathlib import Path

from marsupial_service.store.errors import StoreError
from marsupial_service.store.sqlite import Sqlite
from marsupial_service.store.store import Store

SCHEMES = ("postgresql://", "postgres://")


def open_store(place: str | Path) -> Store:
    """Return the store in a folder, made if need be, or in the PostgreSQL database of an address.

    Raises StoreInUse if another server has the folder, StoreError if it can't be used.
    """
    if not str(place).startswith(SCHEMES):
        return Store(Sqlite(Path(place)))
    try:
        from marsupial_service.store.postgres import Postgres  # psycopg is an extra
    except ImportError as error:
        raise StoreError(f"a PostgreSQL store needs: pip install 'marsupial[postgres]' ({error})") from error
    return Store(Postgres(str(place)))
