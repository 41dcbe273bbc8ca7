"""Run jobs in child processes that are always stopped, with everything they started.

A job runs below a warm launcher (`marsupial.processes.fork_server`), started once per process on first use: importing
the planning libraries takes seconds, forking a process that has them takes milliseconds. Each job has a supervisor of
its own (`marsupial.processes.supervisor`) that keeps its limits even while nobody listens here. When this process
ends, in whatever way, launcher, supervisors and jobs end too.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from typing import IO

from marsupial.errors import InternalError
from marsupial.processes import fork_server as zygote
from marsupial.processes import frames, reaper
from marsupial.processes.jobs import Ended, Ending, Job, Message

SUPPORTED = hasattr(os, "fork")
"""Whether this system can fork, which everything here needs."""

PRELOAD = (
    "unified_planning.shortcuts",
    "unified_planning.engines.results",
    "up_tamer.engine",
    "up_aries.solver",
    "marsupial.planning.external.tamer",
    "marsupial.planning.external.aries",
    "marsupial.planning.external.commands",
)
_TRIES = 3
_START_S = 120.0
_SLACK_S = 5.0
_CANCEL_S = 1.0
_POLL_S = 0.2
_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")
_CODE = (
    "import sys; sys.path[:] = {path!r}; "
    "from marsupial.processes.fork_server import main; main({fd}, {asker}, {preload!r})"
)


class Launcher:
    """A running launcher process and the socket to it."""

    def __init__(self, preload: tuple[str, ...] = PRELOAD) -> None:
        self.owner = os.getpid()
        self._lock = threading.Lock()
        self._stderr: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close
        self._line, theirs = socket.socketpair()
        with theirs:
            code = _CODE.format(path=sys.path, fd=theirs.fileno(), asker=self.owner, preload=preload)
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=self._stderr,
                stderr=self._stderr,
                env={**os.environ, **dict.fromkeys(_ONE_THREAD, "1")},
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        self._ready = self._given_up = False

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def usable(self) -> bool:
        """Say whether it can still be asked by this process."""
        return self.owner == os.getpid() and self._process.poll() is None

    def wait_ready(self) -> None:
        """Wait until its libraries are imported.

        Raises
        ------
        InternalError
            If it ends, was ended, or takes minutes.
        """
        with self._lock:
            if self._ready:
                return
            if self._line.fileno() < 0:
                raise InternalError("the process that starts planners has been ended")
            self._line.settimeout(_START_S)
            try:
                self._ready = self._line.recv(1) == zygote.READY
            except TimeoutError:
                self._give_up()
            if not self._ready:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(_SLACK_S)
                self._stderr.seek(0)
                text = self._stderr.read().decode(errors="replace")[-2000:] or f"exit code {self._process.returncode}"
                raise InternalError(f"the process that starts planners can't be started: {text}")

    def was_killed(self) -> bool:
        """Say whether somebody else has killed it."""
        return not self._given_up and (self._process.poll() or 0) < 0

    def _give_up(self) -> None:
        self._given_up = True
        self._process.kill()

    def connect(self) -> socket.socket:
        """Have a supervisor forked and return the socket to it."""
        ours, theirs = socket.socketpair()
        try:
            with theirs, self._lock:
                socket.send_fds(self._line, [zygote.NEW_JOB], [theirs.fileno()])
        except BaseException:
            ours.close()
            raise
        return ours

    def close(self) -> None:
        """End it and everything below it, and wait for that; a thread in `wait_ready` gets its error."""
        if self.owner != os.getpid():
            self._line.close()
            self._stderr.close()
            return
        if not self._ready and self._process.poll() is None:
            self._give_up()  # nothing runs below it yet, and it would notice only after its imports
        with self._lock:
            self._line.close()
            self._stderr.close()
        try:
            self._process.wait(_SLACK_S)
        except subprocess.TimeoutExpired:
            reaper.kill(self._process.pid)
            self._process.wait()


_launcher: Launcher | None = None
_preload: tuple[str, ...] = PRELOAD
_launcher_lock = threading.Lock()


def _current() -> Launcher:
    global _launcher
    with _launcher_lock:
        if _launcher is None or not _launcher.usable():
            if _launcher is not None:
                _launcher.close()
            _launcher = Launcher(_preload)
        return _launcher


def warm_up(*, wait: bool = True, preload: tuple[str, ...] = ()) -> None:
    """Start the launcher, if it isn't running, so that the first job doesn't wait for imports.

    Parameters
    ----------
    wait
        Whether to return only once the imports are done (a few seconds); else they go on by themselves.
    preload
        Modules that it is to import besides `PRELOAD`, as will every launcher that replaces it. One that is running
        already, without them, goes on: then the first jobs wait for these imports.
    """
    global _preload
    _preload = tuple(dict.fromkeys((*_preload, *preload)))
    launcher = _current()
    if wait:
        launcher.wait_ready()


def shutdown() -> None:
    """End the launcher and all jobs; the next job starts a new one."""
    global _launcher
    with _launcher_lock:
        launcher, _launcher = _launcher, None
    if launcher is not None:
        launcher.close()


atexit.register(shutdown)


class Run:
    """A running job: iterate over it to get what it yields, then exactly one `Ended`.

    `cancel` may be called from another thread while one waits for the next value. When `close` returns, nothing of
    the job is running any more.
    """

    def __init__(self, job: Job) -> None:
        self._control = _start(job)
        self._asked = time.monotonic()
        self._grace_s = job.limits.grace_s
        self._deadline = self._asked + job.limits.wall_s + self._grace_s + _SLACK_S
        self._supervisor = 0
        self._over = False
        self._frames = self._read_frames()

    def __iter__(self) -> Run:
        """Return itself."""
        return self

    def __next__(self) -> Message | Ended:
        """Wait for the next value or the end."""
        if self._over:
            raise StopIteration
        elapsed_s = time.monotonic() - self._asked
        for tag, payload in self._frames:
            elapsed_s = time.monotonic() - self._asked
            if tag == frames.MESSAGE:
                return Message(value=pickle.loads(payload), elapsed_s=elapsed_s)
            if tag == frames.ENDED:
                ended: Ended = pickle.loads(payload)
                return self._end(ended)
        detail = "the process that watched it was killed or does not answer"
        return self._end(Ended(ending=Ending.KILLED, detail=detail, wall_s=elapsed_s))

    def cancel(self) -> None:
        """Ask for the job to be ended; returns at once. A supervisor that doesn't do so soon is killed."""
        self._deadline = min(self._deadline, time.monotonic() + self._grace_s + _CANCEL_S)
        with contextlib.suppress(OSError):
            self._control.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        """End the job if it is running, and wait until nothing of it is left."""
        self.cancel()
        self._over = True
        self._deadline = time.monotonic() + _SLACK_S
        while self._read():
            pass
        self._control.close()

    def _end(self, ended: Ended) -> Ended:
        self.close()
        return ended

    def _read_frames(self) -> Iterator[tuple[bytes, bytes]]:
        buffer = frames.FrameBuffer()
        while chunk := self._read():
            buffer.feed(chunk)
            for tag, payload in buffer.frames():
                if tag == frames.START:
                    self._supervisor = int(payload)
                else:
                    yield tag, payload

    def _read(self) -> bytes:
        while True:
            try:
                self._control.settimeout(_POLL_S)
                return self._control.recv(1 << 16)
            except TimeoutError:
                # Only a supervisor that is stopped or starved is this late: it keeps the limit by itself.
                if time.monotonic() > self._deadline:
                    if self._supervisor:
                        reaper.kill(self._supervisor)
                    return b""
            except OSError:
                return b""


def run(job: Job) -> Run:
    """Start `job` in a child process.

    The time counts from here, not from the start of the launcher, which is waited for where it is not warm.

    Raises
    ------
    InternalError
        If the launcher can't be started.
    """
    return Run(job)


def _start(job: Job) -> socket.socket:
    """Send the job to a new supervisor; a launcher that was killed is replaced, unless that happens over and over."""
    spec = (job.function, job.limits, pickle.dumps(job.argument), sys.path)
    data = frames.pack(frames.START, pickle.dumps(spec))
    for left in reversed(range(_TRIES)):
        launcher = _current()
        try:
            launcher.wait_ready()
        except InternalError:
            if not left or not launcher.was_killed():
                raise
            continue
        with contextlib.suppress(OSError):
            control = launcher.connect()
            try:
                control.sendall(data)
                return control
            except OSError:
                control.close()
        launcher.close()
    raise InternalError(f"the process that starts planners has ended {_TRIES} times in a row")
