"""Times as people read them: one rounding for terminal, films and figures; pages have the same in ``format.js``."""

from __future__ import annotations


def clock_text(seconds: float) -> str:
    """Return a time as ``1:02:03`` or ``2:03``, to the nearest second; a half is rounded up."""
    minutes, rest = divmod(int(seconds + 0.5), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
