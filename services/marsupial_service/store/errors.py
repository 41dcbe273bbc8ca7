"""What can go wrong with the store."""

from __future__ import annotations


class StoreError(Exception):
    """Nothing was stored; the message says why (no space, no permission, a damaged file, no connection)."""


class StoreInUse(StoreError):
    """Another server uses the folder."""
