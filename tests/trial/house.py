"""A server on a data folder, which may be killed at any moment and started again at the same address.

The process that has one adopts orphans: whatever a server has started, in whatever session, stays below it, and is
found when it is left behind.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from marsupial.processes import reaper
from trial import talk

_SERVE = "from marsupial.cli.main import main; main()"
_START_S = 120.0
_POLL_S = 0.01
_ENDED = (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


class NotStarted(Exception):
    """A server doesn't answer; its log says why."""


class House:
    """A folder, a port, and the server that has both while it runs.

    Parameters
    ----------
    options
        Of `marsupial serve`, besides folder and port.
    """

    def __init__(self, folder: Path, options: Sequence[str] = ()) -> None:
        reaper.adopt_orphans()
        self.port = _free_port()
        self._folder = folder
        self._options = options
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def log(self) -> Path:
        """What all its servers have said."""
        return self._folder / "log.jsonl"

    @property
    def data(self) -> Path:
        """The data folder."""
        return self._folder / "data"

    @property
    def pid(self) -> int:
        """Process id of the server that was started last."""
        assert self._process is not None
        return self._process.pid

    @property
    def runs(self) -> bool:
        """Whether the server that was started last still runs."""
        return self._process is not None and self._process.poll() is None

    @property
    def ended_by_itself(self) -> bool:
        """Whether the server that was started last has ended, and not because it was killed."""
        return self._process is not None and self._process.poll() not in (None, -signal.SIGKILL)

    def start(self, environment: Mapping[str, str] | None = None) -> None:
        """Start a server; returns at once."""
        place = ["--port", str(self.port), "--data", str(self.data)]
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-c", _SERVE, "serve", *place, *self._options],
                env={**os.environ, **(environment or {})},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def wait_ready(self, within_s: float = _START_S) -> None:
        """Wait until it can plan. Raises NotStarted."""
        until = time.monotonic() + within_s
        while time.monotonic() < until and self.runs:
            with suppress(*talk.BROKEN):
                if talk.ask(self.port, "GET", "/readyz").status == 200:
                    return
            time.sleep(_POLL_S)
        raise NotStarted(self.log.read_text(errors="replace")[-2000:])

    def kill(self) -> None:
        """Kill the server as by ``kill -9`` and wait for it."""
        assert self._process is not None
        self._process.kill()
        self._process.wait()

    def terminate(self, within_s: float = 30.0) -> float:
        """Ask the server to end and return how long it takes until nothing of it runs, in s."""
        assert self._process is not None
        below = self.below()
        begun = time.monotonic()
        self._process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(within_s)
        while any(is_alive(pid) for pid in below) and time.monotonic() < begun + within_s:
            time.sleep(_POLL_S)
        return time.monotonic() - begun

    def below(self, depth: int | None = None) -> list[int]:
        """Return what runs below the server: 1 is the launcher, 2 supervisors, 3 workers, from 4 on what they start."""
        levels = [[self.pid]]
        while levels[-1]:
            levels.append([child for pid in levels[-1] for child in reaper.children(pid) if is_alive(child)])
        if depth is not None:
            return levels[depth] if depth < len(levels) else []
        return [pid for level in levels[1:] for pid in level]

    def resident_bytes(self) -> int:
        """Return the memory that the server process has to itself."""
        return reaper.resident_bytes([self.pid])

    def close(self) -> None:
        """End it and everything below it."""
        if self.runs:
            self.terminate()
        if self.runs:
            self.kill()
        end_strays()


@contextmanager
def opened(options: Sequence[str] = ()) -> Iterator[House]:
    """Give a house in a folder of its own, started and ready; nothing of it is left afterwards."""
    with unopened(options) as house:
        house.start()
        house.wait_ready()
        yield house


@contextmanager
def unopened(options: Sequence[str] = ()) -> Iterator[House]:
    """Give a house whose server is still to be started."""
    with TemporaryDirectory(prefix="marsupial-trial-", ignore_cleanup_errors=True) as folder:
        house = House(Path(folder), options)
        try:
            yield house
        finally:
            house.close()


def strays(within_s: float = 0.0) -> list[int]:
    """Return what still runs below this process though no server does, once it had so many seconds to end."""
    until = time.monotonic() + within_s
    while True:
        reaper.reap()
        left = [pid for pid in reaper.descendants(os.getpid()) if is_alive(pid)]
        if not left or time.monotonic() >= until:
            return left
        time.sleep(_POLL_S)


def end_strays() -> None:
    """Kill what was left behind, and collect what has ended."""
    for pid in strays():
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    reaper.reap()


def is_alive(pid: int) -> bool:
    """Say whether a process runs; one that has ended and was not collected does not."""
    try:
        return psutil.Process(pid).status() not in _ENDED
    except psutil.NoSuchProcess:
        return False


def _free_port() -> int:
    with socket.socket() as line:
        line.bind((talk.HOST, 0))
        port: int = line.getsockname()[1]
        return port
