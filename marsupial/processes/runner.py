"""Where supervised processes run: on this machine, or where another runner has room.

A caller asks a runner for *room*, waits for it, and runs one job there.
"""

from typing import Protocol

from marsupial.processes import launcher
from marsupial.processes.jobs import Job
from marsupial.processes.launcher import JobRun, Preload


class Reservation(Protocol):
    """A place for one job, from when `wait` returns until the job ends or `close` is called.

    `close` may be called at any time from another thread, and ends the waiting.
    """

    def wait(self) -> bool:
        """Wait for the place; return False if it was closed meanwhile."""

    def run(self, job: Job) -> JobRun:
        """Start the one job. Raises InternalError if no process can be started here."""

    def close(self) -> None:
        """Give the place up, unless a job has it."""


class Runner(Protocol):
    """Runs jobs in processes that always end."""

    def warm_up(self, preload: tuple[Preload, ...] = (), *, wait: bool = False) -> None:
        """Load what jobs need and is not loaded yet; see `launcher.warm_up`. Raises InternalError if `wait`."""

    def reserve(self, cpus: float = 1.0) -> Reservation:
        """Ask for room for a job that counts as so many processors, where they are counted; returns at once."""

    def trouble(self) -> str | None:
        """Return why no job can run at present, or None if one can."""

    def shutdown(self) -> None:
        """End all jobs, and the waiting for room."""


class _Here:
    """Room on this machine, which is never short of it."""

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
        return _Here()

    def trouble(self) -> str | None:
        return None

    def shutdown(self) -> None:
        launcher.shutdown()


LOCAL = LocalRunner()
