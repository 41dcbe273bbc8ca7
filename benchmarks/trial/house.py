"""A server on a data folder, which may be killed at any moment and started again at the same address.

The process that has one adopts orphans: whatever a server has started, in whatever session, stays below it, and is
found when it is left behind.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import talk
from launcher_tree import is_alive
from servers import NotStarted, Server

from marsupial.processes import reaper

_START_S = 120.0
_POLL_S = 0.01


class House(Server):
    """A server with all that runs below it, and the limits that operators have."""

    environment: Mapping[str, str] = {}

    def __init__(self, data: Path, *options: str) -> None:
        super().__init__(data, *options)
        reaper.adopt_orphans()

    @property
    def ended_by_itself(self) -> bool:
        """Whether the server that was started last has ended, and not because it was killed."""
        return not self.runs and self.process.returncode != -signal.SIGKILL

    def wait_ready(self, within_s: float = _START_S) -> None:
        """Wait until it can plan. Raises NotStarted."""
        until = time.monotonic() + within_s
        while time.monotonic() < until and self.runs:
            with suppress(*talk.BROKEN):
                if self.ask("GET", "/readyz").status == 200:
                    return
            time.sleep(_POLL_S)
        raise NotStarted(self.log[-2000:])

    def terminate(self, within_s: float = 30.0) -> float:
        """Ask the server to end and return how long it takes until nothing of it runs, in s."""
        below = self.below()
        begun = time.monotonic()
        self.process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(within_s)
        while any(is_alive(pid) for pid in below) and time.monotonic() < begun + within_s:
            time.sleep(_POLL_S)
        return time.monotonic() - begun

    def below(self, depth: int | None = None) -> list[int]:
        """Return what runs below the server: 1 is the launcher, 2 supervisors, 3 workers, from 4 on what they start."""
        levels = [[self.process.pid]]
        while levels[-1]:
            levels.append([child for pid in levels[-1] for child in reaper.children(pid) if is_alive(child)])
        if depth is not None:
            return levels[depth] if depth < len(levels) else []
        return [pid for level in levels[1:] for pid in level]

    def resident_bytes(self) -> int:
        """Return the memory that the server process has to itself."""
        return reaper.resident_bytes([self.process.pid])

    def close(self, keep: Collection[int] = ()) -> None:
        """End it and everything below it, and all else below this process but what is in `keep`."""
        if self.runs:
            self.terminate()
        if self.runs:
            self.kill()
        end_strays(keep)


@contextmanager
def opened(options: Sequence[str] = ()) -> Iterator[House]:
    """Give a house in a folder of its own, started and ready; nothing of it is left afterwards."""
    with unopened(options) as house:
        house.launch()
        house.wait_ready()
        yield house


@contextmanager
def unopened(options: Sequence[str] = ()) -> Iterator[House]:
    """Give a house whose server is still to be started."""
    with TemporaryDirectory(prefix="marsupial-trial-", ignore_cleanup_errors=True) as folder:
        house = House(Path(folder), *options)
        try:
            yield house
        finally:
            house.close()


def strays(within_s: float = 0.0, keep: Collection[int] = ()) -> list[int]:
    """Return what still runs below this process though no server does, once it had so many seconds to end.

    The processes in `keep`, children of this one, may run, with all that is below them.
    """
    until = time.monotonic() + within_s
    while True:
        left = [pid for child in _others(keep) for pid in (child, *reaper.descendants(child)) if is_alive(pid)]
        if not left or time.monotonic() >= until:
            return left
        time.sleep(_POLL_S)


def _others(keep: Collection[int]) -> list[int]:
    """Return the children of this process that are not in `keep`; those that have ended are collected."""
    others = [child for child in reaper.children(os.getpid()) if child not in keep]
    for child in others:
        with suppress(ChildProcessError):
            os.waitpid(child, os.WNOHANG)
    return others


def end_strays(keep: Collection[int] = ()) -> None:
    """Kill what was left behind, and collect what has ended."""
    for pid in strays(keep=keep):
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    _others(keep)
