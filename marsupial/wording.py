"""How times and numbers of things are told to people, wherever they are told."""

from __future__ import annotations


def clock(seconds: float) -> str:
    """Return a time as ``1:02:03`` or ``2:03``, to the nearest second; a half is rounded up, as ``format.js`` does."""
    minutes, rest = divmod(int(seconds + 0.5), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def counted(number: int, noun: str) -> str:
    """Return a number of things, as ``1 mission`` or ``2 missions``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
