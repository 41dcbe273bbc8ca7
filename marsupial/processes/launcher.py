"""Run jobs in child processes that are always stopped, with everything they started.

A job runs below a warm fork server (`marsupial.processes.fork_server`), started once per process on first use:
importing planning libraries takes seconds, forking a process that has them takes milliseconds. Each job has a
supervisor of its own (`marsupial.processes.supervisor`) that keeps its limits even while nobody listens here. When
this process ends, in whatever way, fork server, supervisors and workers end too.
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
from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType
from typing import IO

from marsupial.errors import InternalError
from marsupial.processes import channel as frames
from marsupial.processes import fork_server, reaper
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import Ended, Ending, Job, Message, death
from marsupial.processes.worker import Order

Preload = ModuleType | Callable[[], object]
"""What is loaded once for all jobs: a module to be imported, or a function of a module's top level to be called."""

SUPPORTED = hasattr(os, "fork")
"""Whether this system can fork, which everything here needs."""

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables of the environment that numerical libraries read when they are loaded; each is 1 for jobs."""

_TRIES = 3
_START_S = 120.0
_SLACK_S = 5.0
_CANCEL_S = 1.0
_POLL_S = 0.2
_CODE = "import sys; sys.path[:] = {path!r}; from marsupial.processes.fork_server import main; main({fd}, {asker})"


class Launcher:
    """A running fork server, which begins by loading `preload`, and the socket to it."""

    def __init__(self, preload: tuple[Preload, ...]) -> None:
        self.owner = os.getpid()
        self._asking, self._waiting = threading.Lock(), threading.Lock()
        self._stderr: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close
        self._line, theirs = socket.socketpair()
        with theirs:
            code = _CODE.format(path=sys.path, fd=theirs.fileno(), asker=self.owner)
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=self._stderr,
                stderr=self._stderr,
                env={**os.environ, **dict.fromkeys(ONE_THREAD, "1")},
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )
        self._given_up = False
        self._asked: set[Preload] = set()
        self._loading: list[socket.socket] = []
        self._load(preload)

    @property
    def pid(self) -> int:
        """The process id of the fork server."""
        return self._process.pid

    def usable(self) -> bool:
        """Say whether it can still be asked by this process."""
        return self.owner == os.getpid() and self._process.poll() is None

    def preload(self, wanted: tuple[Preload, ...]) -> None:
        """Have loaded what isn't asked for yet; returns at once. Jobs asked for afterwards begin after that."""
        with self._asking:
            new = tuple(one for one in wanted if one not in self._asked)
            if new:
                self._load(new)

    def _load(self, wanted: tuple[Preload, ...]) -> None:
        self._asked.update(wanted)
        calls = pickle.dumps([pickle.dumps(_call(one)) for one in wanted])
        with contextlib.suppress(OSError):  # it is dead: the next job finds out
            control = self._connect(fork_server.PRELOAD)
            self._loading.append(control)
            control.sendall(calls)
            control.shutdown(socket.SHUT_WR)

    def wait_ready(self) -> None:
        """Wait until all that was asked for is loaded.

        Raises
        ------
        InternalError
            If it ends, was ended, or takes minutes.
        """
        with self._waiting:
            while self._loading:
                self._wait_for(self._loading[0])
                self._loading.pop(0).close()

    def _wait_for(self, control: socket.socket) -> None:
        if control.fileno() < 0:
            raise InternalError("the process that starts planners has been ended")
        control.settimeout(_START_S)
        try:
            if control.recv(1) == fork_server.READY:
                return
        except TimeoutError:
            self._give_up()
        except ConnectionError:  # it has ended before it read what to load
            pass
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_SLACK_S)
        self._stderr.seek(0)
        text = self._stderr.read().decode(errors="replace")[-2000:] or f"it {death(self._process.returncode)}"
        raise InternalError(f"the process that starts planners can't be started: {text}")

    def was_killed(self) -> bool:
        """Say whether somebody else has killed it."""
        return not self._given_up and (self._process.poll() or 0) < 0

    def _give_up(self) -> None:
        self._given_up = True
        self._process.kill()

    def connect(self) -> Channel:
        """Have a supervisor forked and return the channel to it."""
        with self._asking:
            return Channel(self._connect(fork_server.NEW_JOB))

    def _connect(self, request: bytes) -> socket.socket:
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                socket.send_fds(self._line, [request], [theirs.fileno()])
        except BaseException:
            ours.close()
            raise
        return ours

    def close(self) -> None:
        """End it and everything below it, and wait for that; a thread in `wait_ready` gets its error."""
        if self.owner != os.getpid():
            self._close_files()
            return
        if self._loading and self._process.poll() is None:
            self._give_up()  # it would notice only after its imports
        with self._waiting, self._asking:
            self._close_files()
        try:
            self._process.wait(_SLACK_S)
        except subprocess.TimeoutExpired:
            reaper.kill(self._process.pid)
            self._process.wait()

    def _close_files(self) -> None:
        self._stderr.close()
        for line in (self._line, *self._loading):
            line.close()


def _call(wanted: Preload) -> Callable[[], object]:
    """Return what loads it and can be pickled."""
    return partial(importlib.import_module, wanted.__name__) if isinstance(wanted, ModuleType) else wanted


_launcher: Launcher | None = None
_preload: dict[Preload, None] = {}
_launcher_lock = threading.Lock()


def _current() -> Launcher:
    global _launcher
    with _launcher_lock:
        if _launcher is None or not _launcher.usable():
            if _launcher is not None:
                _launcher.close()
            _launcher = Launcher(tuple(_preload))
        return _launcher


def warm_up(*, wait: bool = True, preload: tuple[Preload, ...] = ()) -> None:
    """Start the fork server, if it isn't running, so that jobs don't wait for imports.

    Parameters
    ----------
    wait
        Whether to return only once the imports are done (a few seconds); else they go on by themselves.
    preload
        What it is to load, as will every fork server that replaces it; what it has loaded already costs nothing.
    """
    _preload.update(dict.fromkeys(preload))
    launcher = _current()
    launcher.preload(preload)
    if wait:
        launcher.wait_ready()


def shutdown() -> None:
    """End the fork server and all jobs; the next job starts a new one."""
    global _launcher
    with _launcher_lock:
        launcher, _launcher = _launcher, None
    if launcher is not None:
        launcher.close()


atexit.register(shutdown)


class Run:
    """A running job: iterate over it to get what it sends, then exactly one `Ended`.

    `cancel` and `send` may be called from another thread while one waits for the next value. When `close` returns,
    nothing of the job is running any more.
    """

    def __init__(self, job: Job) -> None:
        self._channel = _start(job)
        self._asked = time.monotonic()
        self._grace_s = job.limits.grace_s
        self._deadline = self._asked + job.limits.wall_s + self._grace_s + _SLACK_S
        self._supervisor = 0
        self._over = False

    def __iter__(self) -> Run:
        """Return itself."""
        return self

    def __next__(self) -> Message | Ended:
        """Wait for the next value or the end."""
        if self._over:
            raise StopIteration
        is_heard = True
        while is_heard:
            for tag, payload in self._frames():
                if tag == frames.MESSAGE:
                    return Message(value=pickle.loads(payload), elapsed_s=time.monotonic() - self._asked)
                self.close()
                ended: Ended = pickle.loads(payload)
                return ended
            is_heard = self._hear()
        self.close()
        detail = "the process that watched it was killed or does not answer"
        return Ended(ending=Ending.KILLED, detail=detail, wall_s=time.monotonic() - self._asked)

    def follow(self, take: Callable[[object], object]) -> Ended:
        """Hand every value the job sends to `take`, and return its end."""
        while isinstance(event := next(self), Message):
            take(event.value)
        return event

    def send(self, value: object) -> None:
        """Send a value to a job that talks; one that is over doesn't get it, and its end comes next."""
        with contextlib.suppress(OSError):
            self._channel.send(value)

    def cancel(self) -> None:
        """Ask for the job to be ended; returns at once. A supervisor that doesn't do so soon is killed."""
        self._deadline = min(self._deadline, time.monotonic() + self._grace_s + _CANCEL_S)
        self._channel.end()

    def close(self) -> None:
        """End the job if it is running, and wait until nothing of it is left."""
        self.cancel()
        self._over = True
        self._deadline = time.monotonic() + _SLACK_S
        while self._channel.fileno() >= 0 and self._hear():
            for _ in self._frames():
                pass
        self._channel.close()

    def _frames(self) -> Iterator[tuple[bytes, bytes]]:
        for tag, payload in self._channel.frames():
            if tag == frames.START:
                self._supervisor = int(payload)
            else:
                yield tag, payload

    def _hear(self) -> bool:
        """Wait for more from the supervisor; False if nothing comes any more."""
        while not self._channel.wait(_POLL_S):
            # Only a supervisor that is stopped or starved is this late: it keeps the limit by itself.
            if time.monotonic() > self._deadline:
                if self._supervisor:
                    reaper.kill(self._supervisor)
                return False
        return self._channel.fill()


def run(job: Job) -> Run:
    """Start `job` in a child process.

    The time counts from here, not from the start of the fork server, which is waited for where it is not warm.

    Raises
    ------
    InternalError
        If the fork server can't be started.
    """
    return Run(job)


def _start(job: Job) -> Channel:
    """Send the job to a new supervisor; a fork server that was killed is replaced, but not over and over."""
    order = pickle.dumps(Order(job.limits, sys.path, pickle.dumps(job, protocol=pickle.HIGHEST_PROTOCOL)))
    for left in reversed(range(_TRIES)):
        launcher = _current()
        try:
            launcher.wait_ready()
        except InternalError:
            if not left or not launcher.was_killed():
                raise
            continue
        with contextlib.suppress(OSError):
            channel = launcher.connect()
            if channel.send_frame(frames.START, order):
                return channel
            channel.close()
        launcher.close()
    raise InternalError(f"the process that starts planners has ended {_TRIES} times in a row")
