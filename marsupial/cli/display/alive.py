"""What is going on, told now and then while it takes long."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from marsupial.cli.display.messages import say

EVERY_S = 5.0
"""Wall-clock time after which silence is broken."""


class Alive:
    """Says what is going on whenever nothing has been said for a while, from its start to its end.

    Parameters
    ----------
    what
        Returns what is going on; it is called by another thread.
    """

    def __init__(self, what: Callable[[], str], every_s: float = EVERY_S) -> None:
        self._what = what
        self._every_s = every_s
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
            if not self._spoken.wait(self._every_s):
                say(self._what())
            self._spoken.clear()
