"""Wait for a condition in tests, with a limit that only a hang reaches, however loaded the machine is."""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import TypeVar

HANG_S = 600.0
"""Seconds after which a test gives up. Limits of the product that a test does not examine are set as high."""

_POLL_S = 0.01
T = TypeVar("T")


class WaitTimeout(AssertionError):
    """The condition that a test waits for did not become true in time."""


def wait_until(found: Callable[[], T], waits_for: object = "") -> T:
    """Return the first true value of `found`. Raises WaitTimeout with the text `waits_for`."""
    end_s = time.monotonic() + HANG_S
    while not (value := found()):
        if time.monotonic() > end_s:
            raise WaitTimeout(f"{waits_for or found} did not happen within {HANG_S:g} s")
        time.sleep(_POLL_S)
    return value


def doubling_budgets(seconds: float) -> Iterator[float]:
    """Yield budgets, each twice the previous one, until the caller breaks the loop. Raises WaitTimeout."""
    while seconds < HANG_S:
        yield seconds
        seconds *= 2
    raise WaitTimeout(f"not done within {seconds / 2:g} s")


async def wait_until_async(found: Callable[[], Awaitable[T] | T], waits_for: object = "") -> T:
    """Return the first true value of `found`, which may be async. Raises WaitTimeout with the text `waits_for`."""
    end_s = time.monotonic() + HANG_S
    while True:
        value = found()
        if isinstance(value, Awaitable):
            value = await value
        if value:
            return value
        if time.monotonic() > end_s:
            raise WaitTimeout(f"{waits_for or found} did not happen within {HANG_S:g} s")
        await asyncio.sleep(_POLL_S)
