"""The runner for many machines: every mission is a task of a Ray cluster.

Scenarios and strategies of files are put into the cluster's object store once. Missions are started in order, a few
more than there are processors so that none is idle. A mission lost with its worker or node is started again from its
seed, as in the local pool. Ray's own retries are off, since they would not be counted.
"""

import pickle
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import suppress
from typing import Any

from marsupial.bench.compare.conduct import TrialQueue
from marsupial.bench.compare.plan import Comparison, Trial
from marsupial.bench.compare.ray_cluster import Cluster, connected, ray_error
from marsupial.bench.compare.ray_task import Requirements, WorkerMismatch, attend
from marsupial.bench.compare.rows import Result
from marsupial.errors import UsageError
from marsupial.model.planning import Budget
from marsupial.versions import versions

RemoteWork = Callable[[Trial, Sequence[Any], Budget, Requirements], Result]

_LOOK_S = 5.0


class RayPool:
    """Runs missions on a usable Ray cluster; `work` is the function of a task. See `MissionRunner`."""

    def __init__(self, comparison: Comparison, cluster: Cluster, work: RemoteWork = attend) -> None:
        self._comparison = comparison
        self._cluster = cluster
        self._work = work

    def results(self, trials: Sequence[Trial]) -> Generator[Result]:
        """See `MissionRunner`; wait while the cluster has no nodes, raise a `UsageError` if it is lost or refuses."""
        waiting = TrialQueue(trials)
        running: dict[Future[Result], tuple[Trial, Any]] = {}
        with connected(self._cluster) as ray:
            start = self._starter(ray)
            try:
                while waiting or running:
                    # Ask again each time, since nodes may join; a few more tasks than processors leave none idle.
                    processors = int(ray.cluster_resources().get("CPU", 0))
                    room = processors + max(2, processors // 4)
                    while len(running) < room and (trial := waiting.take()) is not None:
                        reference = start(trial)
                        running[reference.future()] = trial, reference
                    # ray.wait would swallow what a signal handler raises
                    for done in wait(running, _LOOK_S, FIRST_COMPLETED).done:
                        trial, _ = running.pop(done)
                        if (result := self._outcome(ray, trial, done, waiting)) is not None:
                            yield result
            except ConnectionError as error:
                raise self._refusal("the cluster was lost", error) from error
            except ModuleNotFoundError as error:  # Ray Client passes on the head's import error
                raise self._refusal("not the same is installed there", error) from error
            finally:
                # also when the caller stops early: tasks would go on without anyone to take their results
                with suppress(ConnectionError):
                    for _, reference in running.values():
                        ray.cancel(reference, force=True)

    def _starter(self, ray: Any) -> Callable[[Trial], Any]:
        """Return a function that starts a mission and returns the reference to its result."""
        # pickled here, so that the object store holds bytes and a worker unpacks them once (`ray_task.unpacked`)
        task = ray.remote(num_cpus=1, max_retries=0)(self._work)
        store = [ray.put(pickle.dumps((dict(self._comparison.scenarios), self._comparison.files)))]
        requirements = Requirements(versions=versions(), token=not self._cluster.is_local)
        return lambda trial: task.remote(trial, store, self._comparison.budget, requirements)

    def _outcome(self, ray: Any, trial: Trial, done: Future[Result], waiting: TrialQueue) -> Result | None:
        """Return the result of a task; None if the mission was queued again."""
        lost = (
            ray.exceptions.WorkerCrashedError,
            ray.exceptions.NodeDiedError,
            ray.exceptions.OutOfMemoryError,
            ray.exceptions.ObjectLostError,
        )
        try:
            return done.result()
        except lost as error:
            return waiting.lost(trial, type(error).__name__)
        except ray.exceptions.RayError as error:
            cause = getattr(error, "cause", None)
            if isinstance(cause, WorkerMismatch):
                raise ray_error(str(cause)) from error
            raise self._refusal(f"{trial} could not be carried out", error) from error

    def _refusal(self, what: str, error: Exception) -> UsageError:
        return ray_error(f"{self._cluster.address}: {what}: {error}")
