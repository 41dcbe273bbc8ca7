"""The value of a function that runs in a supervised process: analyses, large bodies, the check of readiness."""

import asyncio
import logging
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from typing import TypeVar, cast

from marsupial.errors import InternalError
from marsupial.processes import launcher
from marsupial.processes.jobs import Ended, Ending, Job, JobLimits, Message
from marsupial.processes.launcher import JobRun
from marsupial_service.entries.records import TooMany
from marsupial_service.entries.slots import Slots
from marsupial_service.problems import HttpProblem

# how often to start a process that something else kills
_TRIES = 3
_RETRY_S = 2
# ends that the process caused itself: a restart would not help
_OWN_FAULTS = (Ending.TIMEOUT, Ending.MEMORY, Ending.CRASHED)
# most processes at a time. They have their own threads, so that starting processes never blocks other work
_MOST_PROCESSES = 16

A = TypeVar("A")
V = TypeVar("V")
log = logging.getLogger("marsupial.service")


class SupervisedProcesses:
    """Supervised processes; `begin_shutdown` ends all current and future ones."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(_MOST_PROCESSES, "supervised")
        self._lock = threading.Lock()
        self._runs: set[JobRun] = set()
        self._leaving = False

    async def value_of(self, function: Callable[[A], V], argument: A, limits: JobLimits) -> V:
        """Return the value of a top-level `function`.

        Raises HttpProblem if the function does, or returns nothing within the limits.
        """
        job = Job(function=_yield_value, argument=(function, argument), limits=limits)
        value = await asyncio.get_running_loop().run_in_executor(self._threads, self._value, job)
        return cast(V, value)

    def begin_shutdown(self) -> None:
        """End all processes; return at once."""
        with self._lock:
            self._leaving = True
            for run in self._runs:
                run.cancel()

    def _value(self, job: Job) -> object:
        for _ in range(_TRIES):
            event = self._event(job)
            if isinstance(event, Message) or event.ending in _OWN_FAULTS:
                break
        return _value_in(event)

    def _event(self, job: Job) -> Message | Ended:
        if self._leaving:
            raise _unavailable("the service is shutting down")
        with closing(_started(job)) as run:
            with self._lock:
                self._runs.add(run)
                if self._leaving:  # meanwhile
                    run.cancel()
            try:
                return next(run)
            finally:
                with self._lock:
                    self._runs.discard(run)


def _yield_value(call: tuple[Callable[[A], V], A]) -> Iterator[V | HttpProblem]:
    """Yield the value of a function, or its HttpProblem; the function of a job."""
    function, argument = call
    try:
        yield function(argument)
    except HttpProblem as problem:
        yield problem


def _started(job: Job) -> JobRun:
    try:
        return launcher.run(job)
    except InternalError as error:
        log.error("a process can't be started", extra={"reason": str(error)})
        raise _unavailable("no process can be started; see the server log") from error


def _value_in(event: Message | Ended) -> object:
    if isinstance(event, Message):
        if isinstance(event.value, HttpProblem):
            raise event.value
        return event.value
    if event.ending in (Ending.TIMEOUT, Ending.MEMORY):
        raise HttpProblem("too-large", f"the request takes more time or memory than allowed: {event.detail}")
    if event.ending is Ending.CRASHED:
        log.error("a process crashed", extra={"reason": event.detail, "output": event.output})
        raise HttpProblem("internal", "the process for this request crashed; see the server log")
    raise _unavailable("the process for this request was killed")


def _unavailable(text: str) -> HttpProblem:
    return HttpProblem("not-ready", text, headers={"Retry-After": str(_RETRY_S)})


@dataclass(slots=True, kw_only=True)
class RequestProcesses:
    """Processes that serve one request each, a limited number at a time; keys take turns, and are charged for use."""

    supervised: SupervisedProcesses
    slots: Slots
    limits: JobLimits  # of each process
    check_quota: Callable[[str], Awaitable[None]]  # raises TooMany if an owner has used up the quota
    charge: Callable[[str, float], None]  # gets the owner and the seconds that a process took

    async def value_of(
        self,
        owner: str,
        function: Callable[[A], V],
        argument: A,
        wait_s: float | None = None,
        *,
        needs_quota: bool = False,
    ) -> V:
        """Return the value of `function`, run in a process as soon as it is the owner's turn.

        Raises TooMany if no slot was free within `wait_s`, the owner already waits for as many slots as there are, or
        (with `needs_quota`) has used up the quota; HttpProblem if the function does, or returns nothing within the
        limits.
        """
        slots = self.slots
        if needs_quota:  # before it waits for nothing
            await self.check_quota(owner)
        text = f"at most {slots.count} such requests run at a time, and as many of one key wait"
        if wait_s is not None and slots.waiting(owner) >= slots.count:
            raise TooMany(text)
        try:
            async with asyncio.timeout(wait_s):
                slot = await slots.for_owner(owner)
        except TimeoutError:
            raise TooMany(text) from None
        with slots.holding(slot):
            if needs_quota:  # others of its owner may have used it up meanwhile
                await self.check_quota(owner)
            begun_s = time.monotonic()
            try:
                return await self.supervised.value_of(function, argument, self.limits)
            finally:
                self.charge(owner, time.monotonic() - begun_s)
