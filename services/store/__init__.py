"""The embedded store: one SQLite file, one writer that commits in groups, readers beside it."""

from services.store.errors import KeyReused, StoreError, StoreInUse
from services.store.store import Store
from services.store.writer import Transaction

__all__ = ["KeyReused", "Store", "StoreError", "StoreInUse", "Transaction"]
