"""What can go wrong with the store."""

from __future__ import annotations


class StoreError(Exception):
    """Nothing was stored; the message says why (no space, no permission, a damaged file, no connection).

    Attributes
    ----------
    told
        What anybody may be told: it names no file, address or user.
    """

    def __init__(self, message: str, told: str = "the store can't be used; the log says why") -> None:
        super().__init__(message)
        self.told = told


class StoreInUse(StoreError):
    """Another server uses the folder."""
