"""Ctrl-C and termination: an exception in most commands, a request to end in missions.

An interrupted command unwinds, so that planner processes end and temporary files are removed. A mission is first asked
to end at its next event and write its stop report; a second signal unwinds it like any other command.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from marsupial.cli.display.messages import say

SIGNALS = (signal.SIGINT, signal.SIGTERM)

ENDING = "ending the mission; interrupt once more to stop at once"

Handler = Callable[[int, FrameType | None], object]


class Interrupted(BaseException):
    """The command was interrupted."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise `Interrupted` in the body on Ctrl-C or termination."""

    def leave(number: int, frame: FrameType | None) -> None:
        raise Interrupted

    with _handling(leave):
        yield


@contextmanager
def stop_requests() -> Iterator[Callable[[], int]]:
    """Yield a function that returns the number of signals so far, for a command that ends by itself in two steps."""
    asked: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        asked.append(number)
        if len(asked) == 1:
            say(ENDING)

    with _handling(note):
        yield lambda: len(asked)


@contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether there was a signal; a second one raises `Interrupted`."""
    asked = threading.Event()

    def note(number: int, frame: FrameType | None) -> None:
        if asked.is_set():
            raise Interrupted
        asked.set()
        say(ENDING)

    with _handling(note):
        yield asked.is_set


@contextmanager
def _handling(handler: Handler) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():  # only the main thread receives signals
        yield
        return
    before = [(number, signal.signal(number, handler)) for number in SIGNALS]
    try:
        yield
    finally:
        for number, old in before:
            signal.signal(number, old)
