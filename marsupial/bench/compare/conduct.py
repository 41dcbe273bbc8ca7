"""Run the remaining missions of a comparison and store their results.

A `MissionRunner` runs missions on this machine (`LocalPool`) or on a cluster (`RayPool`). Both take them from a
`TrialQueue`, which hands out a mission again if its worker died.

`LocalPool` has worker processes, each with one mission at a time, and a thread per worker that sends it its missions.
Numerical libraries get one thread in each worker, so that N workers use N cores; only the search of the anytime planner
has two threads, which share the cores that the workers leave.
"""

import os
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from queue import SimpleQueue
from typing import Protocol

from marsupial.bench.compare import trial as worker
from marsupial.bench.compare.folder import opened, read_rows, sort_lines
from marsupial.bench.compare.plan import Comparison, Trial, header_of
from marsupial.bench.compare.rows import CRASHED, MissionRow, Result
from marsupial.errors import InternalError
from marsupial.library.choices import decider_of
from marsupial.library.first_use import prepare_mission
from marsupial.library.missions import check_foreseen
from marsupial.processes import launcher as processes
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import Ended, Job, JobLimits
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import check_suits

MOST_TRIES = 2  # how often a mission is started whose worker dies


class MissionRunner(Protocol):
    """Runs missions in parallel; made with the `Comparison`, so that each worker gets the scenarios only once."""

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        """Yield exactly one result for each of `trials`, as they are done.

        A mission whose worker dies is run once more; if that one dies too, the result is a row of status `CRASHED`.
        Closing the generator stops all workers.
        """
        ...


class TrialQueue:
    """The missions that wait for a worker, and how often each was started. Thread-safe."""

    def __init__(self, trials: Sequence[Trial]) -> None:
        self._trials = deque(trials)
        self._tries = dict.fromkeys(trials, 0)

    def __len__(self) -> int:
        return len(self._trials)

    def take(self) -> Trial | None:
        """Return the next mission to start, None if there is none."""
        try:  # asking for the length first would race with other threads
            trial = self._trials.popleft()
        except IndexError:
            return None
        self._tries[trial] += 1
        return trial

    def lost(self, trial: Trial, how: str) -> Result | None:
        """Queue a mission again after its worker died; if that happened too often, return its result instead."""
        if self._tries[trial] < MOST_TRIES:
            self._trials.appendleft(trial)
            return None
        return Result(
            row=MissionRow(trial=trial, status=CRASHED, reason=f"the worker process died {MOST_TRIES} times: {how}")
        )


def check_teams(comparison: Comparison) -> None:
    """Raise a `ScenarioError` if a contender can't lead the team of one of the scenarios."""
    for contender in comparison.contenders:
        if contender.strategy == CLAIRVOYANT:
            for case, scenario in comparison.scenarios.items():
                check_foreseen(scenario, str(case))
            continue
        decider = decider_of(comparison.strategy(contender), contender.planner, comparison.budget)
        for scenario in comparison.scenarios.values():
            check_suits(decider, [scenario.type_of(member).role for member in scenario.team])


def compile_first(comparison: Comparison, say: Callable[[str], None]) -> None:
    """Compile here what the workers then load: each of them would compile the same code at the same time."""
    scenario = next(iter(comparison.scenarios.values()))
    for contender in comparison.contenders:
        prepare_mission(scenario, comparison.strategy(contender), contender.planner, say)()


Watch = Callable[[MissionRow | None, int, int], None]
"""Called after each mission with its row, the number of missions done and their total; with None at the start."""


def conduct(
    comparison: Comparison, runner: MissionRunner, out: Path, watch: Watch, *, drop: Sequence[str] = ()
) -> None:
    """Run the missions whose row is not in the folder `out` yet, and those with a status in `drop`.

    The folder can be resumed whenever this ends. Raise a `UsageError` or `InputError` if it can't be used.
    """
    trials = tuple(comparison.trials())
    with opened(out, header_of(comparison), drop=drop) as add:
        done = {row.trial for row in read_rows(out)}
        left = [trial for trial in trials if trial not in done]
        watch(None, len(done), len(trials))
        if left:
            with closing(runner.results(left)) as results:
                for result in results:
                    add(result)
                    done.add(result.row.trial)
                    watch(result.row, len(done), len(trials))
    sort_lines(out, trials)


WorkerFunction = Callable[[worker.Terms, Channel], None]


class LocalPool:
    """Runs missions in `workers` processes on this machine, None for one per core; `work` is the function of each.

    See `MissionRunner`. It takes no strategies that are objects: their code may be known to the caller's process alone.
    """

    def __init__(self, comparison: Comparison, workers: int | None, work: WorkerFunction = worker.serve) -> None:
        terms = (dict(comparison.scenarios), comparison.budget, comparison.files)
        self._job = Job(function=work, argument=terms, limits=JobLimits(memory_bytes=None), talks=True)
        self._size = _cores() if workers is None else workers

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


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
