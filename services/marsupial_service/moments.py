"""Moments: integer milliseconds since 1970 (UTC) inside, RFC 3339 text where anybody reads them."""

from __future__ import annotations

import time
from datetime import UTC, datetime


def wall_clock_ms() -> int:
    """Return now."""
    return time.time_ns() // 1_000_000


def timestamp(ms: int) -> str:
    """Return a moment as RFC 3339 text, UTC, with milliseconds."""
    moment = datetime.fromtimestamp(ms // 1000, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{ms % 1000:03d}Z"


def timestamp_if_any(ms: int | None) -> str | None:
    """Return the text of a moment that may not have come."""
    return None if ms is None else timestamp(ms)
