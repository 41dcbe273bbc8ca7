"""Messages to people, on stderr.

All commands have three volumes: `--quiet` prints errors only, `--verbose` also prints each step. The volume is one for
the process, since messages also come from threads.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from enum import IntEnum


class Volume(IntEnum):
    """How much is printed."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2


_volume = Volume.NORMAL


def set_volume(volume: Volume) -> None:
    """Set how much is printed from now on."""
    global _volume
    _volume = volume


def volume() -> Volume:
    """Return how much is printed."""
    return _volume


def say(text: str) -> None:
    """Print a message."""
    if _volume is not Volume.QUIET:
        complain(text)


def warn(text: str) -> None:
    """Print a warning."""
    say(f"warning: {text}")


def complain(text: str) -> None:
    """Print an error, whatever the volume."""
    # A full disk behind stderr is ignored, since only messages are lost; a reader that has gone ends the program.
    try:
        print(text, file=sys.stderr, flush=True)
    except BrokenPipeError:
        raise
    except OSError:
        with suppress(OSError):  # drops the buffered text, which the next write would try again
            sys.stderr.flush()
