"""Messages to people, on stderr.

There are three volumes for all commands: `--quiet` leaves errors, `--verbose` adds each step of what goes on. The
volume is one for the process, since messages also come from threads.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from enum import IntEnum


class Volume(IntEnum):
    """How much is told."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2


_volume = Volume.NORMAL


def set_volume(volume: Volume) -> None:
    """Set how much is told from now on."""
    global _volume
    _volume = volume


def volume() -> Volume:
    """Return how much is told."""
    return _volume


def say(text: str) -> None:
    """Print a message."""
    if _volume is not Volume.QUIET:
        complain(text)


def warn(text: str) -> None:
    """Print a warning."""
    say(f"warning: {text}")


def complain(text: str) -> None:
    """Print what went wrong, whatever the volume.

    A full disk below stderr ends nothing: what is lost are words. That nobody reads any more does.
    """
    try:
        print(text, file=sys.stderr, flush=True)
    except BrokenPipeError:
        raise
    except OSError:
        with suppress(OSError):  # text kept for the next try would be refused again
            sys.stderr.flush()
