"""One attempt at a job: a thread that reads the worker's output and stores it."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace

from marsupial.errors import InternalError, UsageError
from marsupial.planning.engines import PROCESSES
from marsupial.processes import launcher
from marsupial.processes.jobs import Ended, Ending, Job, JobLimits
from marsupial.processes.launcher import JobRun
from marsupial_service.jobs import table
from marsupial_service.jobs.records import Analysed, Closed, Found, JobSettings, WorkerTask
from marsupial_service.jobs.work import GAVE_UP, solve
from marsupial_service.planners import engine_name
from marsupial_service.schemas.enums import JobOutcome
from marsupial_service.store import Store, StoreError, Transaction

# how long a planner that enforces its own budget may exceed it before it is stopped: ours, an operator's
_SLACK_S, _COMMAND_SLACK_S = 1.0, 0.5

# a slow disk does not block a planner at once; a planner that floods the store waits
_MOST_UNSTORED = 16
# pause before a failed write is repeated
_RETRY_S = 1.0

_OUTCOMES: Mapping[Ending, JobOutcome] = {
    Ending.FINISHED: JobOutcome.ENGINE_FAILED,
    Ending.CRASHED: JobOutcome.ENGINE_FAILED,
    Ending.MEMORY: JobOutcome.OUT_OF_MEMORY,
    Ending.TIMEOUT: JobOutcome.TIMEOUT,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class AttemptLost:
    """The attempt ended through no fault of the job; `reason` is empty if this server ended it."""

    reason: str


class Attempt:
    """An attempt at the job of `claim`. Any thread may call `cancel` at any time.

    `took_s` is how long its processes took from request to end; 0 until they end.
    """

    def __init__(self, claim: table.Claim, store: Store, settings: JobSettings) -> None:
        self.claim = claim
        self._store = store
        self._settings = settings
        self._lock = threading.Lock()
        self._run: JobRun | None = None
        self._cancelled = threading.Event()
        self._unstored: deque[tuple[Callable[[Transaction], bool], Future[bool]]] = deque()
        self._has_plan = claim.start is not None
        self._closed: Closed | None = None
        self._cancelled_s = math.inf
        self._begun_s = time.monotonic()
        self.took_s = 0.0

    @property
    def tail_s(self) -> float:
        """How long its processes took to end after it was cancelled, in seconds."""
        return max(0.0, self._begun_s + self.took_s - self._cancelled_s)

    def cancel(self) -> None:
        """Request the attempt's end; return at once."""
        with self._lock:
            self._cancelled_s = min(self._cancelled_s, time.monotonic())
            self._cancelled.set()
            if self._run is not None:
                self._run.cancel()

    def run(self) -> Closed | AttemptLost:
        """Run the attempt to its end; on return its processes have ended and its plans are stored."""
        self._begun_s = time.monotonic()
        try:
            run = launcher.run(self._job())
        except UsageError as error:  # in the store, whoever may write to it can have changed the name
            return Closed(outcome=JobOutcome.UNSUPPORTED, detail=f"planner: {error}")
        except InternalError as error:
            return self._lost(str(error))
        finally:
            self.took_s = time.monotonic() - self._begun_s
        ended = None
        try:
            with self._lock:
                self._run = run
                # `cancel` was called before there was a run to cancel
                if self._cancelled.is_set():
                    run.cancel()
            ended = run.follow(self._take)
            self._wait_stored(0)
        except StoreError as error:
            return self._lost(str(error))
        finally:
            run.close()
            # by the supervisor's clock, if possible: waiting for the store is not planning
            self.took_s = time.monotonic() - self._begun_s if ended is None else self.took_s + ended.wall_s
        return self._closed or self._outcome_of(ended)

    def _job(self) -> Job:
        claim, settings = self.claim, self._settings
        limit_s = settings.limits.steps_s if claim.budget.seconds is None else claim.budget.seconds
        if claim.planner not in PROCESSES:
            limit_s += _COMMAND_SLACK_S if claim.planner in settings.commands else _SLACK_S
        engine = engine_name(claim.planner, settings.commands)
        task = WorkerTask(
            source=claim.source, limits=settings.limits, engine=engine, budget=claim.budget, start=claim.start
        )
        limits = JobLimits(wall_s=limit_s, memory_bytes=settings.limits.memory_bytes)
        return Job(function=solve, argument=task, limits=limits)

    def _take(self, value: object) -> None:
        claim, now_ms = self.claim, self._settings.now_ms()
        match value:
            case Found() as found:
                self._has_plan = True
                self._store_later(lambda tx: table.add_plan(tx, claim, found, now_ms))
            case Analysed() as analysed:
                self._store_later(lambda tx: table.add_analysis(tx, claim, analysed))
            case Closed() as closed:
                self._closed = closed
        self._wait_stored(_MOST_UNSTORED)

    def _store_later(self, write: Callable[[Transaction], bool]) -> None:
        self._unstored.append((write, self._store.write(write)))

    def _wait_stored(self, at_most: int) -> None:
        """Wait until at most `at_most` writes are left to store, through any outage; planning continues meanwhile."""
        while len(self._unstored) > at_most:
            write, written = self._unstored.popleft()
            while (error := written.exception()) is not None:
                if not isinstance(error, StoreError) or self._cancelled.wait(_RETRY_S):
                    raise error
                written = self._store.write(write)

    def _outcome_of(self, ended: Ended) -> Closed | AttemptLost:
        """Convert the end of the processes to an end of the attempt."""
        if self._cancelled.is_set() or ended.ending in (Ending.KILLED, Ending.CANCELLED):
            return self._lost(ended.detail)
        closed = Closed(outcome=_OUTCOMES[ended.ending], detail=ended.detail)
        if self._has_plan and closed.outcome in GAVE_UP:
            return replace(closed, outcome=JobOutcome.SATISFICING)
        return closed

    def _lost(self, reason: str) -> AttemptLost:
        return AttemptLost(reason="" if self._cancelled.is_set() else reason)
