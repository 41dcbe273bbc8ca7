"""Runners of supervised processes: on this machine, or elsewhere.

A caller requests *room* from a runner, waits for it, and runs one job there.
"""

from typing import Protocol

from marsupial.processes import launcher
from marsupial.processes.jobs import Job
from marsupial.processes.launcher import JobRun, Preload


class Reservation(Protocol):
    """A place for one job, from when `wait` returns until the job ends or `close` is called.

    `close` may be called at any time from another thread, and ends the wait.
    """

    def wait(self) -> bool:
        """Wait for the place; return False if it was closed meanwhile."""

    def run(self, job: Job) -> JobRun:
        """Start the one job. Raises InternalError if no process can be started here."""

    def close(self) -> None:
        """Release the place, unless a job uses it."""


class Runner(Protocol):
    """Runs jobs in processes that always end."""

    def warm_up(self, preload: tuple[Preload, ...] = (), *, wait: bool = False) -> None:
        """Load missing libraries for jobs; see `launcher.warm_up`. Raises InternalError if `wait`."""

    def reserve(self, cpus: float = 1.0) -> Reservation:
        """Request room for a job that counts as this many processors, where they are counted; return at once."""

    def fault(self) -> str | None:
        """Return why no job can run at present, or None if one can."""

    def shutdown(self) -> None:
        """End all jobs and all waits for room."""


class _LocalReservation:
    """Room on this machine, which is always available."""

    def wait(self) -> bool:
        return True

    def run(self, job: Job) -> JobRun:
        return launcher.run(job)

    def close(self) -> None:
        pass


class LocalRunner:
    """Runs jobs below this process."""

    def warm_up(self, preload: tuple[Preload, ...] = (), *, wait: bool = False) -> None:
        launcher.warm_up(wait=wait, preload=preload)

    def reserve(self, cpus: float = 1.0) -> Reservation:
        return _LocalReservation()

    def fault(self) -> str | None:
        found = launcher.loading_now()
        return None if found is None else f"starting: {found}"

    def shutdown(self) -> None:
        launcher.shutdown()


LOCAL = LocalRunner()
