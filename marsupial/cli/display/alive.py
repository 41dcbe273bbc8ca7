"""What is going on, told now and then while it takes long."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from marsupial.cli.display.messages import say

FIRST_S, LAST_S = 5.0, 60.0
"""Wall-clock time after which silence is broken: each time twice as long as the time before, up to the last."""


class Alive:
    """Says what is going on whenever nothing has been said for a while, from its start to its end.

    Whoever waits soon knows that it is at work; what takes hours is no flood of lines.

    Parameters
    ----------
    what
        Returns what is going on; it is called by another thread.
    """

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
        """Print a message, and be silent for a while."""
        say(text)
        self._spoken.set()

    def _watch(self) -> None:
        while not self._over:
            if not self._spoken.wait(self._patience_s):
                say(self._what())
                self._patience_s = min(2 * self._patience_s, self._last_s)
            self._spoken.clear()
