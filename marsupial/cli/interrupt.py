"""Ctrl-C and termination: one exception for commands in general, a polite request for missions.

A command that is interrupted unwinds, so engines' processes are ended and temporary files removed. A mission is asked
to end at its next event first, so that it can write its stop report; a second signal unwinds it like any other command.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from marsupial.cli.display.messages import say

SIGNALS = (signal.SIGINT, signal.SIGTERM)

ENDING = "ending the mission; once more to stop at once"

Handler = Callable[[int, FrameType | None], object]


class Interrupted(BaseException):
    """The command was asked to end now."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Raise `Interrupted` wherever the program is when it is asked to end."""

    def leave(number: int, frame: FrameType | None) -> None:
        raise Interrupted

    with _handling(leave):
        yield


@contextmanager
def stop_requests() -> Iterator[Callable[[], int]]:
    """Yield a function that says how often the command was asked to end: for one that ends by itself, in two steps."""
    asked: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        asked.append(number)
        if len(asked) == 1:
            say(ENDING)

    with _handling(note):
        yield lambda: len(asked)


@contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether the command was asked to end; the second time `Interrupted` is raised."""
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
    if threading.current_thread() is not threading.main_thread():  # only the main thread can be told
        yield
        return
    before = [(number, signal.signal(number, handler)) for number in SIGNALS]
    try:
        yield
    finally:
        for number, old in before:
            signal.signal(number, old)
