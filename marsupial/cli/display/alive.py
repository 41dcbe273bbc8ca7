"""Occasional messages during long work."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from marsupial.cli.display.messages import say

FIRST_S, LAST_S = 5.0, 60.0
"""Wall-clock time without a message before one is printed: doubled each time, up to the last value."""


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
