"""Moments: integer milliseconds since 1970 (UTC) inside, RFC 3339 text outside."""

import time
from datetime import UTC, datetime


def wall_clock_ms() -> int:
    return time.time_ns() // 1_000_000


def timestamp(ms: int) -> str:
    """Return a moment as RFC 3339 text, UTC, with milliseconds."""
    moment = datetime.fromtimestamp(ms // 1000, UTC)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.{ms % 1000:03d}Z"
