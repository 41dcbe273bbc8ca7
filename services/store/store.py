"""The store: a folder with one SQLite file, locked by one server."""

from __future__ import annotations

from pathlib import Path


class Transaction:
    """What a write is given."""


class Store:
    """The store in `folder`; made if need be. Raises StoreInUse, StoreError."""

    def __init__(self, folder: Path) -> None:
        raise NotImplementedError

    def close(self) -> None:
        """Commit what is under way and let go of the folder."""
        raise NotImplementedError
