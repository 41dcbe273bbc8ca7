"""The embedded store: one SQLite file, one writer that commits in groups, readers beside it."""

from marsupial_service.store.errors import StoreError, StoreInUse
from marsupial_service.store.store import Store
from marsupial_service.store.writer import Transaction

__all__ = ["Store", "StoreError", "StoreInUse", "Transaction"]
