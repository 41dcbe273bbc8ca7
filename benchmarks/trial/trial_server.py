"""A server on a data folder that can be killed at any moment and restarted at the same address.

The process that owns a server adopts orphans: all processes that a server starts, in any session, stay below it, and
are found if the server leaves them behind.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from support.processes.process_tree import is_alive
from support.services.servers import Server

from marsupial.processes import reaper

_POLL_S = 0.01


class TrialServer(Server):
    """A server with all processes below it, and operators' limits."""

    environment: Mapping[str, str] = {}
    program = (sys.executable, "-m", "benchmarks.trial.failpoints", "serve")
    ready_s = 120.0

    def __init__(self, data: Path, *options: str) -> None:
        super().__init__(data, *options)
        reaper.adopt_orphans()

    @property
    def ended_by_itself(self) -> bool:
        """Whether the last server started has ended without being killed."""
        return not self.runs and self.process.returncode != -signal.SIGKILL

    def terminate(self, within_s: float = 30.0) -> float:
        """Terminate the server and return the time in s until none of its processes runs."""
        below = self.below()
        begun = time.monotonic()
        self.process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(within_s)
        while any(is_alive(pid) for pid in below) and time.monotonic() < begun + within_s:
            time.sleep(_POLL_S)
        return time.monotonic() - begun

    def below(self, depth: int | None = None) -> list[int]:
        """Return processes below the server: 1 is the launcher, 2 supervisors, 3 workers, from 4 on their children."""
        levels = [[self.process.pid]]
        while levels[-1]:
            levels.append([child for pid in levels[-1] for child in reaper.children(pid) if is_alive(child)])
        if depth is not None:
            return levels[depth] if depth < len(levels) else []
        return [pid for level in levels[1:] for pid in level]

    def resident_bytes(self) -> int:
        """Return the server process's own memory."""
        return reaper.resident_bytes([self.process.pid])

    def close(self, keep: Collection[int] = ()) -> None:
        """End the server, all processes below it, and all others below this process except those in `keep`."""
        if self.runs:
            self.terminate()
        if self.runs:
            self.kill()
        kill_orphans(keep)


@contextmanager
def running_server(options: Sequence[str] = ()) -> Iterator[TrialServer]:
    """Yield a server in its own folder, started and ready; remove all of it afterwards."""
    with new_server(options) as server:
        server.launch()
        server.wait_ready()
        yield server


@contextmanager
def new_server(options: Sequence[str] = ()) -> Iterator[TrialServer]:
    """Yield a server that has not been started; remove all of it afterwards."""
    with TemporaryDirectory(prefix="marsupial-trial-", ignore_cleanup_errors=True) as folder:
        server = TrialServer(Path(folder), *options)
        try:
            yield server
        finally:
            server.close()


def orphans(within_s: float = 0.0, keep: Collection[int] = ()) -> list[int]:
    """Return processes that still run below this one without a server, after `within_s` seconds to end.

    The processes in `keep`, children of this one, may run, with all processes below them.
    """
    until = time.monotonic() + within_s
    while True:
        left = [pid for child in _others(keep) for pid in (child, *reaper.descendants(child)) if is_alive(pid)]
        if not left or time.monotonic() >= until:
            return left
        time.sleep(_POLL_S)


def _others(keep: Collection[int]) -> list[int]:
    """Return the children of this process that are not in `keep`; reap those that have ended."""
    others = [child for child in reaper.children(os.getpid()) if child not in keep]
    for child in others:
        with suppress(ChildProcessError):
            os.waitpid(child, os.WNOHANG)
    return others


def kill_orphans(keep: Collection[int] = ()) -> None:
    """Kill the processes left behind, and reap those that have ended."""
    for pid in orphans(keep=keep):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    _others(keep)
