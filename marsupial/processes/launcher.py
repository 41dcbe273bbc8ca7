"""Run jobs in child processes that always end, together with all their descendants.

A job runs below a warm fork server (`marsupial.processes.fork_server`), started once per process on first use:
importing planning libraries takes seconds, forking a process that has them takes milliseconds. Each job has a
supervisor of its own (`marsupial.processes.supervisor`) that enforces its limits even while this process does not read.
However this process ends, fork server, supervisors and workers end too.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import os
import pickle
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import IO

from marsupial.errors import InternalError
from marsupial.processes import channel as frames
from marsupial.processes import fork_server, loading, reaper
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import GRACE_S, Ended, Ending, Job, JobLimits, JobOrder, Message, exit_text
from marsupial.processes.loading import Loading

Preload = ModuleType | Callable[[], object]
"""What to load once for all jobs: a module to import, or a module's top-level function to call."""

SUPPORTED = hasattr(os, "fork")
"""Whether this system can fork, as this package requires."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables that numerical libraries read when they are loaded; each is 1 for jobs."""

_TRIES = 3
# seconds in which a fork server that still starts has to load something more: compiling the largest function takes
# about ten seconds, and minutes on a machine that is busy with other work
_SILENCE_S = 600
# how late a supervisor may report the end of its job before it counts as dead
_SLACK_S = 5.0
_CANCEL_S = 1.0
_LEAVE_S = 1.0
_POLL_S = 1.0
_CODE = (
    "import sys; sys.path[:] = {path!r}; "
    "from marsupial.processes.fork_server import main; main({fd}, {client}, {progress})"
)


class Launcher:
    """A running fork server, and the socket to it."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self._lock = threading.Lock()
        self._ended = False
        self.requests = 0  # to load, that were sent
        self._stderr: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close
        self._progress: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close
        self._line, theirs = socket.socketpair()
        with theirs:
            files = {"fd": theirs.fileno(), "progress": self._progress.fileno()}
            code = _CODE.format(path=sys.path, client=self.owner, **files)
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=self._stderr,
                stderr=self._stderr,
                env={**os.environ, **dict.fromkeys(ONE_THREAD, "1")},
                pass_fds=tuple(files.values()),
                # Ctrl-C in a terminal goes to this process only, which ends its children
                start_new_session=True,
            )

    def usable(self) -> bool:
        """Return whether this process can still send requests to it."""
        return self.owner == os.getpid() and self._process.poll() is None

    def was_killed(self) -> bool:
        """Return whether another process has killed it, or the process that it has just forked."""
        code = self._process.poll()
        return not self._ended and (code is None or code < 0)

    def ask(self, request: bytes, order: object) -> Channel:
        """Send a request and return the channel for its reply; the channel is closed if the process is dead."""
        ours, theirs = socket.socketpair()
        channel = Channel(ours)
        with theirs, self._lock, contextlib.suppress(OSError):
            socket.send_fds(self._line, [request], [theirs.fileno()])
        channel.send_frame(frames.START, pickle.dumps(order))
        return channel

    def loading(self) -> Loading:
        """Return how far it is with loading."""
        with self._lock:
            return Loading() if self._progress.closed else loading.read(self._progress.fileno())

    def answer(self, channel: Channel) -> bytes:
        """Wait for the reply: all earlier requests to load are done then.

        Raises InternalError if it ends, or loads nothing more for minutes.
        """
        frame, told, silent_s, fault = None, self.loading(), 0.0, ""
        try:
            while frame is None and not fault:
                try:
                    frame = channel.receive_frame(_POLL_S)
                    fault = "" if frame is not None else self._last_output()
                except TimeoutError:
                    before, told = told, self.loading()
                    silent_s = silent_s + _POLL_S if told == before else 0.0
                    if silent_s >= _SILENCE_S:
                        fault = f"it was ended, as it got no further within {_SILENCE_S} s ({told})"
                        self._ended = True
                        self._process.kill()
        finally:
            if frame is None:
                channel.close()
        if frame is None:
            raise InternalError(f"the process that starts planners can't be started: {fault}")
        return frame[1]

    def _last_output(self) -> str:
        """Return its last output, or how it ended."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_LEAVE_S)
        with self._lock:
            if self._stderr.closed:
                return "it was shut down"
            self._stderr.seek(0)
            text = self._stderr.read().decode(errors="replace")[-2000:]
        code = self._process.returncode
        return text or ("the processes that it starts are killed" if code is None else f"it {exit_text(code)}")

    def close(self) -> None:
        """End it and all its descendants, and wait for their end; callers that wait for a reply get an error."""
        self._ended = True
        with self._lock:
            self._line.close()
            self._stderr.close()
            self._progress.close()
        if self.owner != os.getpid():
            return
        self._process.terminate()  # during an import it does not read its socket
        try:
            self._process.wait(_SLACK_S)
        except subprocess.TimeoutExpired:
            reaper.kill(self._process.pid)
            self._process.wait()


_launcher: Launcher | None = None
_preload: dict[Preload, None] = {}
_launcher_lock = threading.Lock()


def _current() -> Launcher:
    global _launcher
    with _launcher_lock:
        if _launcher is None or not _launcher.usable():
            if _launcher is not None:
                _launcher.close()
            _launcher = Launcher()
            _send_preload(_launcher).close()
        return _launcher


def loading_now() -> Loading | None:
    """Return how far the fork server is with loading what it was asked to load; None if that is done, or none runs."""
    launcher = _launcher
    if launcher is None or not launcher.usable():
        return None
    found = launcher.loading()
    return found if found.requests < launcher.requests else None


def _send_preload(launcher: Launcher) -> Channel:
    launcher.requests += 1
    return launcher.ask(fork_server.PRELOAD, [pickle.dumps(_call(one)) for one in _preload])


def _call(wanted: Preload) -> Callable[[], object]:
    """Return a picklable function that loads it."""
    return partial(importlib.import_module, wanted.__name__) if isinstance(wanted, ModuleType) else wanted


def warm_up(*, wait: bool = True, preload: tuple[Preload, ...] = ()) -> None:
    """Start the fork server unless it runs, and make it and all its replacements load `preload`.

    With `wait`, return only after loading (a few seconds), and raise InternalError if the server can't be started. Jobs
    wait for the loading anyway, before their time counts.
    """
    _preload.update(dict.fromkeys(preload))
    launcher = _current()
    channel = _send_preload(launcher)
    if wait:
        launcher.answer(channel)
    channel.close()


def shutdown() -> None:
    """End the fork server and all jobs; the next job starts a new one."""
    global _launcher
    with _launcher_lock:
        launcher, _launcher = _launcher, None
    if launcher is not None:
        launcher.close()


atexit.register(shutdown)


class JobRun:
    """A running job: iterating over it yields the values it sends, then exactly one `Ended`.

    `cancel` and `send` may be called from another thread while one waits for the next value. When `close` returns, no
    process of the job is running.
    """

    def __init__(self, channel: Channel, supervisor: int, limits: JobLimits) -> None:
        self._channel = channel
        self._supervisor = supervisor  # its process id
        self._started = time.monotonic()
        self._deadline = self._started + limits.wall_s + GRACE_S + _SLACK_S
        self._over = False

    def __iter__(self) -> JobRun:
        return self

    def __next__(self) -> Message | Ended:
        if self._over:
            raise StopIteration
        frame = self._frame()
        if frame is None:
            detail = "its supervisor was killed or does not respond"
            event = Ended(ending=Ending.KILLED, detail=detail, wall_s=time.monotonic() - self._started)
        elif frame[0] == frames.MESSAGE:
            return Message(value=pickle.loads(frame[1]), elapsed_s=time.monotonic() - self._started)
        else:
            event = pickle.loads(frame[1])
        self.close()
        return event

    def follow(self, take: Callable[[object], object]) -> Ended:
        """Pass every value the job sends to `take`, and return its `Ended`."""
        while isinstance(event := next(self), Message):
            take(event.value)
        return event

    def send(self, value: object) -> None:
        """Send a value to a job that talks; a job that has ended doesn't get it, and its `Ended` comes next."""
        with contextlib.suppress(OSError):
            self._channel.send(value)

    def put(self, value: object) -> bool:
        """Send as much of a value as possible without blocking; return whether `drain` has to send the rest."""
        self._channel.put_value(value)
        self._channel.flush()
        return self._channel.unsent > 0

    def drain(self) -> None:
        """Block until the socket has accepted all queued values."""
        self._channel.drain()

    def cancel(self) -> None:
        """Request the end of the job; return at once. A supervisor that does not end it soon is killed."""
        self._deadline = min(self._deadline, time.monotonic() + GRACE_S + _CANCEL_S)
        self._channel.end()

    def close(self) -> None:
        """End the job if it is running, and wait until all its processes have ended."""
        self.cancel()
        self._over = True
        self._deadline = time.monotonic() + _SLACK_S
        while self._frame() is not None:
            pass
        self._channel.close()

    def _frame(self) -> tuple[bytes, bytes] | None:
        """Wait for the next frame of the supervisor; None if no more frames follow."""
        while self._channel.fileno() >= 0:
            try:
                return self._channel.receive_frame(_POLL_S)
            except TimeoutError:
                # Only a stopped or starved supervisor is this late: it enforces the limit itself.
                if time.monotonic() > self._deadline:
                    reaper.kill(self._supervisor)
                    break
        return None


def run(job: Job) -> JobRun:
    """Start `job` in a child process.

    Its time counts from the start of its process, not while the fork server still loads libraries. A killed fork server
    is replaced, but only a limited number of times. Raises InternalError if it can't be started.
    """
    order = JobOrder(job.limits, sys.path, pickle.dumps(job, protocol=pickle.HIGHEST_PROTOCOL))
    tries_left = _TRIES
    while True:
        launcher = _current()
        channel = launcher.ask(fork_server.NEW_JOB, order)
        try:
            return JobRun(channel, int(launcher.answer(channel)), job.limits)
        except InternalError:
            tries_left -= 1
            if not tries_left or not launcher.was_killed():
                raise
