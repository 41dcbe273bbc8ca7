"""Messages to people, on stderr, also during long work.

All commands have three volumes: `--quiet` prints errors only, `--verbose` also prints each step. One volume serves
the whole process, since messages also come from threads.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from enum import IntEnum
from threading import Event, Thread

# Wall-clock time without a message before one is printed: doubled each time, up to the last value.
FIRST_S, LAST_S = 5.0, 60.0


class Volume(IntEnum):
    """How much is printed."""

    QUIET, NORMAL, VERBOSE = range(3)


_volume = Volume.NORMAL


def set_volume(volume: Volume) -> None:
    global _volume
    _volume = volume


def volume() -> Volume:
    return _volume


def say(text: str) -> None:
    if _volume is not Volume.QUIET:
        complain(text)


def warn(text: str) -> None:
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


class Alive:
    """A context manager that prints the message from `what`, called in a thread, if nothing was printed for a while."""

    def __init__(self, what: Callable[[], str], first_s: float = FIRST_S, last_s: float = LAST_S) -> None:
        self._what = what
        self._patience_s = first_s
        self._last_s = last_s
        self._spoken = Event()
        self._over = False
        self._thread = Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Alive:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over = True
        self._spoken.set()
        self._thread.join()

    def say(self, text: str) -> None:
        """Print a message, and restart the interval."""
        say(text)
        self._spoken.set()

    def _watch(self) -> None:
        while not self._over:
            if not self._spoken.wait(self._patience_s):
                say(self._what())
                self._patience_s = min(2 * self._patience_s, self._last_s)
            self._spoken.clear()
