"""One value from a function that runs in a supervised process: analyses, and the check whether planning works."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import Any

from marsupial.processes import launcher as processes
from marsupial.processes.jobs import Ending, Job, JobLimits, Message
from marsupial_service.http.problems import HttpProblem


async def value_of(
    function: Callable[[Any], Iterable[object]], argument: object, *, seconds: float, memory_bytes: int
) -> object:
    """Return the first value of a top-level `function`. Raises HttpProblem if there is none within the limits."""
    job = Job(function=function, argument=argument, limits=JobLimits(wall_s=seconds, memory_bytes=memory_bytes))
    return await asyncio.to_thread(_first, job)


def _first(job: Job) -> object:
    run = processes.run(job)
    try:
        event = next(run)
    finally:
        run.close()
    if isinstance(event, Message):
        return event.value
    if event.ending in (Ending.TIMEOUT, Ending.MEMORY):
        raise HttpProblem("too-large", f"it takes more than the service allows: {event.detail}")
    raise HttpProblem("internal", f"the process for it ended: {event.ending}")
