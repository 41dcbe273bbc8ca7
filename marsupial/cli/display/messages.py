"""Messages to people, on stderr."""

from __future__ import annotations

import sys


def say(text: str) -> None:
    """Print a message."""
    print(text, file=sys.stderr, flush=True)


def warn(text: str) -> None:
    """Print a warning."""
    say(f"warning: {text}")
