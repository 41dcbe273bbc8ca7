"""Values kept in the store as pickles."""

from __future__ import annotations

import pickle
from typing import Any


def dumps(value: object) -> bytes:
    """Return a value as it is kept."""
    return pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)


def loads(data: bytes) -> Any:
    """Return the value that is kept so."""
    return pickle.loads(data)
