"""One value from a function that runs in a supervised process: analyses, large bodies, the check of readiness."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from typing import Any

from marsupial.errors import InternalError
from marsupial.processes import launcher as processes
from marsupial.processes.jobs import Ended, Ending, Job, JobLimits, Message
from marsupial.processes.runner import Room, Runner
from marsupial_service.http.problems import HttpProblem

_TRIES = 3
"""How often it is begun where another process kills it."""

_RETRY_S = 2

_OWN = (Ending.TIMEOUT, Ending.MEMORY, Ending.CRASHED)
"""Its own ends: to begin it again would not help."""

_ROOM_S = 5.0
"""How long a process is waited for on a cluster, which has room for it as long as a node is there."""

_MOST = 16
"""At a time. Their threads are their own: while processes are still being made ready, others have work to do."""


log = logging.getLogger("marsupial.service")


class Supervised:
    """Such processes; `leave` ends all there are and will be."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(_MOST, "supervised")
        self._lock = threading.Lock()
        self._runs: set[processes.JobRun] = set()
        self._leaving = False

    async def value_of(
        self, function: Callable[[Any], Iterable[object]], argument: object, *, seconds: float, memory_bytes: int
    ) -> object:
        """Return the first value of a top-level `function`. Raises HttpProblem if there is none within the limits."""
        job = Job(function=function, argument=argument, limits=JobLimits(wall_s=seconds, memory_bytes=memory_bytes))
        return await asyncio.get_running_loop().run_in_executor(self._threads, self._first, job)

    def leave(self) -> None:
        """End them all; returns at once."""
        with self._lock:
            self._leaving = True
            for run in self._runs:
                run.cancel()

    def _first(self, job: Job) -> object:
        for _ in range(_TRIES):
            event = self._event(job)
            if isinstance(event, Message) or event.ending in _OWN:
                break
        return _value_in(event)

    def _event(self, job: Job) -> Message | Ended:
        if self._leaving:
            raise _not_now("the service is ending")
        try:
            run = processes.run(job)
        except InternalError as error:
            raise _no_start(error) from error
        with self._lock:
            self._runs.add(run)
            if self._leaving:
                run.cancel()
        try:
            return next(run)
        finally:
            with self._lock:
                self._runs.discard(run)
            run.close()


async def value_on(
    runner: Runner,
    function: Callable[[Any], Iterable[object]],
    argument: object,
    *,
    seconds: float,
    memory_bytes: int,
) -> object:
    """Return the first value of a function that is run by `runner`, as `Supervised.value_of` does on this machine."""
    job = Job(function=function, argument=argument, limits=JobLimits(wall_s=seconds, memory_bytes=memory_bytes))
    with closing(runner.room(0)) as room:
        try:
            async with asyncio.timeout(_ROOM_S):
                await asyncio.to_thread(room.wait)
        except TimeoutError:
            raise _not_now("no node of the cluster is ready to work") from None
        return _value_in(await asyncio.to_thread(_event_in, room, job))


def _event_in(room: Room, job: Job) -> Message | Ended:
    try:
        run = room.run(job)
    except InternalError as error:
        raise _no_start(error) from error
    with closing(run):
        return next(run)


def _value_in(event: Message | Ended) -> object:
    if isinstance(event, Message):
        return event.value
    if event.ending in (Ending.TIMEOUT, Ending.MEMORY):
        raise HttpProblem("too-large", f"it takes more than the service allows: {event.detail}")
    if event.ending is Ending.CRASHED:
        log.error("a process crashed", extra={"reason": event.detail, "output": event.output})
        raise HttpProblem("internal", "the process for it crashed; the log says why")
    raise _not_now("the process for it was ended")


def _no_start(error: InternalError) -> HttpProblem:
    log.error("a process can't be started", extra={"reason": str(error)})
    return _not_now("no process can be started; the log says why")


def _not_now(said: str) -> HttpProblem:
    return HttpProblem("not-ready", said, headers={"Retry-After": str(_RETRY_S)})
