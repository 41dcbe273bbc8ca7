"""The local runner: worker processes, each with one mission at a time.

A thread per worker sends it its missions. Numerical libraries get one thread in each worker, so that N workers use N
cores; only the search of the anytime planner has two threads, which share the cores that the workers leave.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from queue import SimpleQueue

from marsupial.bench.compare import trial as worker
from marsupial.bench.compare.conduct import TrialQueue
from marsupial.bench.compare.plan import Comparison, Trial
from marsupial.bench.compare.rows import Result
from marsupial.errors import InternalError
from marsupial.processes import launcher as processes
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import Ended, Job, JobLimits

Work = Callable[[worker.Terms, Channel], None]


class LocalPool:
    """Runs missions in `workers` processes on this machine; `work` is the function of each. See `MissionRunner`."""

    def __init__(self, comparison: Comparison, workers: int, work: Work = worker.serve) -> None:
        terms = (dict(comparison.scenarios), comparison.budget)
        self._job = Job(function=work, argument=terms, limits=JobLimits(memory_bytes=None), talks=True)
        self._size = workers

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        # workers are forked from a process that has imported everything already
        processes.warm_up(wait=False, preload=(worker,))
        size = min(self._size, len(trials))
        shift = _Shift(self._job, trials)
        with ThreadPoolExecutor(max(1, size), "worker") as threads:
            try:
                for _ in range(size):
                    threads.submit(shift.work)
                for _ in trials:
                    result = shift.results.get()
                    if isinstance(result, BaseException):
                        raise result
                    yield result
            finally:
                shift.stop()


class _Shift:
    """The missions to run and the workers that run them."""

    def __init__(self, job: Job, trials: Sequence[Trial]) -> None:
        self.results: SimpleQueue[Result | BaseException] = SimpleQueue()
        self._job = job
        self._waiting = TrialQueue(trials)
        self._runs: list[processes.JobRun] = []
        self._stopped = False

    def work(self) -> None:
        """Run missions in one worker, and in a new one if that dies, until none is left."""
        try:
            while self._waiting and not self._stopped:
                with closing(processes.run(self._job)) as run:
                    self._runs.append(run)
                    self._feed(run)
        except BaseException as error:  # raised again in the thread that reads the results
            self.results.put(error)

    def stop(self) -> None:
        """End all workers."""
        self._stopped = True
        for run in self._runs:
            run.cancel()

    def _feed(self, run: processes.JobRun) -> None:
        """Send a worker one mission after the other; if it dies, queue its mission again."""
        trial: Trial | None = None
        for event in run:
            if isinstance(event, Ended):
                if trial is None:  # died before the first mission: a new worker would die too
                    raise InternalError(f"a worker could not be started: {event.detail}")
                if (result := self._waiting.lost(trial, event.detail)) is not None:
                    self.results.put(result)
                return
            if isinstance(event.value, Result):
                self.results.put(event.value)
            # the first event is the worker's READY, each later one a result: either way it is idle now
            trial = self._waiting.take()
            if trial is None or self._stopped:
                return
            run.send(trial)
