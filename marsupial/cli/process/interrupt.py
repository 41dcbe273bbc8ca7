"""Ctrl-C and termination: an exception in most commands, a request to end in missions.

An interrupted command unwinds, so that planner processes end and temporary files are removed. A mission is first asked
to end at its next event and write its stop report; a second signal unwinds it like any other command.
"""

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


def _leave(number: int, frame: FrameType | None) -> None:
    raise Interrupted


@contextmanager
def stop_requests(again: Handler = lambda number, frame: None) -> Iterator[Callable[[], int]]:
    """Yield a function that returns the number of signals so far; `again` is called for those after the first."""
    asked: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        asked.append(number)
        if len(asked) == 1:
            say(ENDING)
        else:
            again(number, frame)

    with interruptible(note):
        yield lambda: len(asked)


@contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether there was a signal; a second one raises `Interrupted`."""
    with stop_requests(again=_leave) as asked:
        yield lambda: asked() > 0


@contextmanager
def interruptible(handler: Handler = _leave) -> Iterator[None]:
    """Call `handler` on Ctrl-C or termination; by default, raise `Interrupted` in the body."""
    if threading.current_thread() is not threading.main_thread():  # only the main thread receives signals
        yield
        return
    before = [(number, signal.signal(number, handler)) for number in SIGNALS]
    try:
        yield
    finally:
        for number, old in before:
            signal.signal(number, old)
