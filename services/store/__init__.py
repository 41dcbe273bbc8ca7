"""The embedded store: one SQLite file, one writer that commits in groups, readers beside it."""

from services.store.errors import StoreError, StoreInUse
from services.store.store import Store
from services.store.writer import Transaction

__all__ = ["Store", "StoreError", "StoreInUse", "Transaction"]
