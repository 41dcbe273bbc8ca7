"""Processes that work for one request: keys have turns, as with jobs, and each is charged for what it used."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from marsupial_service.entries.records import TooMany
from marsupial_service.entries.slots import Slots

if TYPE_CHECKING:
    from marsupial_service.state import State


async def value_in_turn(
    state: State,
    slots: Slots,
    owner: str,
    function: Callable[[Any], Iterable[object]],
    argument: object,
    *,
    seconds: float,
    memory_bytes: int,
    wait_s: float | None = None,
) -> object:
    """Return the first value of `function`, run in a process as soon as it is the owner's turn.

    Raises
    ------
    TooMany
        If there was no turn within `wait_s`, or the owner waits for as many turns as there are slots already.
    HttpProblem
        If there is no value within the limits.
    """
    said = f"at most {slots.count} at a time, and as many of one key that wait"
    if wait_s is not None and slots.waiting(owner) >= slots.count:
        raise TooMany(said)
    try:
        async with asyncio.timeout(wait_s):
            place = await slots.for_owner(owner)
    except TimeoutError:
        raise TooMany(said) from None
    with slots.taken(place):
        begun_s = time.monotonic()
        try:
            return await state.supervised.value_of(function, argument, seconds=seconds, memory_bytes=memory_bytes)
        finally:
            state.running().charge(owner, time.monotonic() - begun_s)


async def read_in_turn(
    state: State, owner: str, function: Callable[[Any], Iterable[object]], argument: object
) -> object:
    """Return what `function` makes of something large, within the limits of reading."""
    limits = state.settings.limits
    return await value_in_turn(
        state,
        state.readers,
        owner,
        function,
        argument,
        seconds=limits.read_s,
        memory_bytes=limits.read_memory_bytes,
    )
