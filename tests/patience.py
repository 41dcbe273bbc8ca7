"""How long tests wait: until what they need is there. However loaded the machine, only what hangs reaches the limit."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import TypeVar

HANG_S = 600.0
"""Seconds after which a test gives up. Where a test does not examine a limit of the product, that is as generous."""

_POLL_S = 0.01
T = TypeVar("T")


class Hung(AssertionError):
    """What a test waits for has not come."""


def until(found: Callable[[], T], waits_for: object = "") -> T:
    """Return the first true value of `found`. Raises Hung, which names what was waited for."""
    end_s = time.monotonic() + HANG_S
    while not (value := found()):
        if time.monotonic() > end_s:
            raise Hung(f"{waits_for or found} has not come in {HANG_S:g} s")
        time.sleep(_POLL_S)
    return value


def longer_and_longer(seconds: float) -> Iterator[float]:
    """Yield budgets, each twice the one before: what has to get done in one may need more of it on a loaded machine.

    Who has got it done breaks off. Raises Hung.
    """
    while seconds < HANG_S:
        yield seconds
        seconds *= 2
    raise Hung(f"it has not got done within {seconds / 2:g} s")


async def awaited(found: Callable[[], Awaitable[T] | T], waits_for: object = "") -> T:
    """Return the first true value of `found`, which may be async. Raises Hung, which names what was waited for."""
    end_s = time.monotonic() + HANG_S
    while True:
        value = found()
        if isinstance(value, Awaitable):
            value = await value
        if value:
            return value
        if time.monotonic() > end_s:
            raise Hung(f"{waits_for or found} has not come in {HANG_S:g} s")
        await asyncio.sleep(_POLL_S)
