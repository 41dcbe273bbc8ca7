"""The local runner: as many worker processes as asked for, each with one mission at a time.

Processes are started anew, not forked, since the asking one may have threads. The numerical libraries get one thread
in each, so that N workers use N cores; the search of the anytime planner has two threads all the same, which share
what the workers leave.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from marsupial.bench.compare.plan import Case, Comparison, Trial
from marsupial.bench.compare.rows import CRASHED, Result, Row
from marsupial.bench.compare.worker import STOP, serve
from marsupial.errors import InternalError
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario

MOST_TRIES = 2
"""How often a mission is begun whose worker dies."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS")

Work = Callable[[Connection, Mapping[Case, Scenario], Budget], None]

_LEAVE_S = 2.0


@dataclass(slots=True, eq=False)
class _Worker:
    process: SpawnProcess
    line: Connection
    ready: bool = False
    trial: Trial | None = None


class LocalPool:
    """Runs missions in `workers` processes on this machine; see `Runner`. `work` is what each of them does."""

    def __init__(self, comparison: Comparison, workers: int, work: Work = serve) -> None:
        self._comparison = comparison
        self._size = workers
        self._work = work

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        """Yield exactly one result for each of `trials`, as they are done; see `Runner`.

        Raises
        ------
        InternalError
            If a worker ends before it has begun to work.
        """
        waiting = deque(trials)
        tries = dict.fromkeys(trials, 0)
        workers: list[_Worker] = []
        try:
            while waiting or any(worker.trial for worker in workers):
                for _ in range(min(self._size - len(workers), len(waiting))):
                    workers.append(self._start())
                for line in wait([worker.line for worker in workers]):
                    worker = next(worker for worker in workers if worker.line is line)
                    result = _received(worker)
                    if worker.line.closed:
                        workers.remove(worker)
                        result = _lost(worker, waiting, tries)
                    else:
                        _give(worker, waiting, tries)
                    if result is not None:
                        yield result
        finally:
            _stop(workers)

    def _start(self) -> _Worker:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        arguments = (theirs, dict(self._comparison.scenarios), self._comparison.budget)
        process = context.Process(target=self._work, args=arguments, daemon=False, name="marsupial-worker")
        with _one_thread(), _deaf_to_interrupts():
            process.start()
        theirs.close()
        return _Worker(process, ours)


def _received(worker: _Worker) -> Result | None:
    """Return the result that a worker has sent, None if it only says that it is ready; close the line of a dead one."""
    try:
        result: Result | None = worker.line.recv()
    except (EOFError, OSError):
        worker.line.close()
        return None
    worker.ready, worker.trial = True, None
    return result


def _give(worker: _Worker, waiting: deque[Trial], tries: dict[Trial, int]) -> None:
    if waiting:
        worker.trial = waiting.popleft()
        tries[worker.trial] += 1
        with suppress(OSError):  # it has just died: its line says so next
            worker.line.send(worker.trial)


def _lost(worker: _Worker, waiting: deque[Trial], tries: dict[Trial, int]) -> Result | None:
    """Let the mission of a dead worker be begun again, or return what is to be said of it."""
    worker.process.join()
    how = _how_it_ended(worker.process.exitcode)
    if not worker.ready:
        raise InternalError(f"a worker process could not be started: {how}")
    trial = worker.trial
    if trial is None:
        return None
    if tries[trial] < MOST_TRIES:
        waiting.appendleft(trial)
        return None
    return Result(row=Row(trial=trial, status=CRASHED, reason=f"the worker process died {MOST_TRIES} times: {how}"))


def _how_it_ended(code: int | None) -> str:
    if code is not None and code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return f"ended with exit code {code}"


def _stop(workers: Sequence[_Worker]) -> None:
    """Let idle workers leave by themselves and end those amid a mission."""
    for worker in workers:
        if worker.trial is not None or not worker.ready:
            worker.process.terminate()
        else:
            with suppress(OSError):
                worker.line.send(STOP)
    for worker in workers:
        worker.process.join(_LEAVE_S)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
        worker.line.close()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Let processes started inside use one thread in numerical libraries, unless the user has said otherwise."""
    added = [name for name in ONE_THREAD if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Let processes started inside not be interrupted by Ctrl-C while they begin."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
