"""One value from a function that runs in a supervised process: analyses, and the check whether planning works."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import Any

from marsupial.processes.jobs import Ending, Job, JobLimits, Message
from marsupial.processes.runner import LOCAL, Room, Runner
from marsupial_service.http.problems import HttpProblem

_ROOM_S = 5.0
"""How long a process is waited for on a cluster, which has room for it as long as a node is there."""


async def value_of(
    function: Callable[[Any], Iterable[object]],
    argument: object,
    *,
    seconds: float,
    memory_bytes: int,
    runner: Runner = LOCAL,
) -> object:
    """Return the first value of a top-level `function`. Raises HttpProblem if there is none within the limits."""
    job = Job(function=function, argument=argument, limits=JobLimits(wall_s=seconds, memory_bytes=memory_bytes))
    room = runner.room(0)
    try:
        try:
            async with asyncio.timeout(_ROOM_S):
                await asyncio.to_thread(room.wait)
        except TimeoutError:
            raise HttpProblem("not-ready", "no node of the cluster is ready to work") from None
        return await asyncio.to_thread(_first, room, job)
    finally:
        room.close()


def _first(room: Room, job: Job) -> object:
    run = room.run(job)
    try:
        event = next(run)
    finally:
        run.close()
    if isinstance(event, Message):
        return event.value
    if event.ending in (Ending.TIMEOUT, Ending.MEMORY):
        raise HttpProblem("too-large", f"it takes more than the service allows: {event.detail}")
    raise HttpProblem("internal", f"the process for it ended: {event.ending}")
