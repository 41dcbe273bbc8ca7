"""The store: a database of jobs and missions, one writer in each server that commits in groups, readers beside it.

It is one SQLite file, or a PostgreSQL database that several servers share.
"""

from marsupial_service.store.engine import StoreError, StoreInUse
from marsupial_service.store.opening import open_store
from marsupial_service.store.store import Store
from marsupial_service.store.transaction import Transaction

__all__ = ["Store", "StoreError", "StoreInUse", "Transaction", "open_store"]
