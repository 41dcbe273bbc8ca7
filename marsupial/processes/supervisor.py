"""The two processes of one job: the worker that runs it and the supervisor that watches it.

Both are forked from the warm, single-threaded launcher (`marsupial.processes.fork_server`). The worker has a session
of its own and runs the function; the supervisor forwards what it yields, keeps the tail of its output, measures its
memory, and ends it and everything below it when a limit is reached, when the asker hangs up, or when the launcher
dies.
"""

from __future__ import annotations

import gc
import importlib
import math
import os
import pickle
import resource
import selectors
import shutil
import signal
import socket
import sys
import tempfile
import time
import traceback
from typing import NoReturn

from marsupial.processes import frames, reaper
from marsupial.processes.jobs import Ended, Ending, Limits, ToolDied, death, ending_of

TAIL_BYTES = 4096
_POLL_S = 0.05
_QUICK_POLL_S = 0.002
_CHUNK = 1 << 16
_BACKLOG = 4 * frames.MAX_BYTES
_FILE_BYTES = 1 << 30


def supervise(control: socket.socket, scratch: str) -> NoReturn:
    """Run the job that comes over `control` and leave the process; files go into a folder below `scratch`."""
    code = 70
    try:
        gc.freeze()
        reaper.adopt_orphans()
        spec = _receive_spec(control)
        if spec is not None:
            folder = tempfile.mkdtemp(prefix="job-", dir=scratch)
            try:
                _Supervisor(control, spec[1], folder, spec).run()
            finally:
                reaper.end_below(os.getpid(), 0.0)
                shutil.rmtree(folder, ignore_errors=True)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


_Spec = tuple[str, Limits, bytes, list[str]]


def _receive_spec(control: socket.socket) -> _Spec | None:
    buffer = frames.FrameBuffer()
    while chunk := control.recv(_CHUNK):
        buffer.feed(chunk)
        for _, payload in buffer.frames():
            spec: _Spec = pickle.loads(payload)
            return spec
    return None


class _Supervisor:
    """Watches one worker; `run` returns once nothing of the job is left and the end was told."""

    def __init__(self, control: socket.socket, limits: Limits, folder: str, spec: _Spec) -> None:
        self.control = control
        self.limits = limits
        self.outbox = bytearray(frames.pack(frames.START, str(os.getpid()).encode()))
        self.inbox = frames.FrameBuffer()
        self.tail = bytearray()
        self.peak = 0
        self.poll_s = _POLL_S
        self.failed: tuple[Ending, str] | None = None
        self.done = False
        self.stop: tuple[Ending, str] | None = None
        signal.signal(signal.SIGTERM, self._on_term)
        self.started = time.monotonic()
        self.worker, self.results, self.output = _fork_worker(control, folder, spec)
        control.setblocking(False)

    def _on_term(self, *_: object) -> None:
        self.stop = (Ending.KILLED, "the process that starts jobs has ended")

    def run(self) -> None:
        """Watch until the worker is over, end all that is left, tell how it ended."""
        returncode = self._watch()
        wall_s = time.monotonic() - self.started
        returncode = reaper.end_below(os.getpid(), self.limits.grace_s).get(self.worker, returncode)
        self._drain()
        ended = self._ended(returncode, wall_s)
        self.outbox += frames.pack(frames.ENDED, pickle.dumps(ended))
        self._flush_for_good()

    def _watch(self) -> int | None:
        with selectors.DefaultSelector() as selector:
            for fd in (self.control.fileno(), self.results, self.output):
                selector.register(fd, selectors.EVENT_READ)
            measured = 0.0
            while self.stop is None:
                wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if self.outbox else 0)
                selector.modify(self.control.fileno(), wanted)
                left = self.started + self.limits.wall_s - time.monotonic()
                for key, events in selector.select(max(0.0, min(self.poll_s, left))):
                    self._serve(selector, key.fd, events)
                ended = reaper.reap()
                if self.worker in ended:
                    return ended[self.worker]
                self._judge_time()
                if time.monotonic() - measured >= _POLL_S:
                    self._judge_memory()
                    measured = time.monotonic()
        return None

    def _serve(self, selector: selectors.BaseSelector, fd: int, events: int) -> None:
        if fd == self.output:
            if not self._read_output():
                selector.unregister(fd)
        elif fd == self.results:
            if len(self.outbox) >= _BACKLOG:
                time.sleep(_QUICK_POLL_S)  # the asker doesn't read: let the worker wait
            elif not self._read_results():
                selector.unregister(fd)
                self.poll_s = _QUICK_POLL_S  # the worker is about to end
        elif events & selectors.EVENT_READ and not _readable(self.control):
            self.stop = self.stop or (Ending.CANCELLED, "cancelled by the one who asked for it")
        elif events & selectors.EVENT_WRITE:
            self._flush()

    def _judge_time(self) -> None:
        if time.monotonic() - self.started >= self.limits.wall_s:
            self.stop = self.stop or (Ending.TIMEOUT, f"stopped at its limit of {self.limits.wall_s:g} s")

    def _judge_memory(self) -> None:
        used = reaper.resident_bytes(reaper.descendants(os.getpid()))
        self.peak = max(self.peak, used)
        if used > self.limits.memory_bytes:
            text = f"stopped with {used >> 20} MiB in use, {self.limits.memory_bytes >> 20} MiB are allowed"
            self.stop = self.stop or (Ending.MEMORY, text)

    def _read_output(self) -> bool:
        chunk = os.read(self.output, _CHUNK)
        self.tail += chunk
        del self.tail[:-TAIL_BYTES]
        return bool(chunk)

    def _read_results(self) -> bool:
        chunk = os.read(self.results, _CHUNK)
        self.inbox.feed(chunk)
        try:
            for tag, payload in self.inbox.frames():
                self._take(tag, payload)
        except frames.FrameTooBig as error:
            self.stop = self.stop or (Ending.CRASHED, str(error))
            return False
        return bool(chunk)

    def _take(self, tag: bytes, payload: bytes) -> None:
        if tag == frames.MESSAGE:
            self.outbox += frames.pack(tag, payload)
        elif tag == frames.FAILED:
            self.failed = pickle.loads(payload)
        elif tag == frames.DONE:
            self.done = True

    def _drain(self) -> None:
        """Take what the worker had still written when it ended; nobody holds the other end of the pipes any more."""
        for fd, read in ((self.results, self._read_results), (self.output, self._read_output)):
            os.set_blocking(fd, False)
            try:
                while read():
                    pass
            except BlockingIOError:
                pass

    def _flush(self) -> None:
        try:
            del self.outbox[: self.control.send(self.outbox[:_CHUNK])]
        except BlockingIOError:
            pass
        except OSError:
            self.stop = self.stop or (Ending.CANCELLED, "the one who asked for it is gone")
            self.outbox.clear()

    def _flush_for_good(self) -> None:
        self.control.setblocking(True)
        try:
            self.control.sendall(self.outbox)
        except OSError:
            self.outbox.clear()

    def _ended(self, returncode: int | None, wall_s: float) -> Ended:
        output = self.tail.decode(errors="replace")
        if self.stop is not None:
            ending, detail = self.stop
        elif self.failed is not None:
            ending, detail = self.failed
        elif self.done and returncode == 0:
            ending, detail = Ending.FINISHED, "finished"
        else:
            code = 0 if returncode is None else returncode
            ending, detail = ending_of(code, output), f"its process {death(code)}"
        return Ended(ending=ending, detail=detail, output=output, wall_s=wall_s, peak_bytes=self.peak)


def _readable(control: socket.socket) -> bool:
    """Say whether the asker is still there; it never sends anything but the job."""
    try:
        return bool(control.recv(1))
    except BlockingIOError:
        return True
    except OSError:
        return False


def _fork_worker(control: socket.socket, folder: str, spec: _Spec) -> tuple[int, int, int]:
    """Fork the worker and return its process id and the read ends of its results and output."""
    results, results_in = os.pipe()
    output, output_in = os.pipe()
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        try:
            os.setsid()
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            reaper.die_with_parent(parent, signal.SIGKILL)
            control.close()
            os.close(results)
            os.close(output)
            os.dup2(output_in, 1)
            os.dup2(output_in, 2)
            os.close(output_in)
            _work(results_in, folder, spec)
        finally:
            os._exit(71)
    os.close(results_in)
    os.close(output_in)
    return pid, results, output


def _work(results: int, folder: str, spec: _Spec) -> NoReturn:
    function, limits, argument, path = spec
    sys.path[:] = path
    os.environ["TMPDIR"] = tempfile.tempdir = folder
    _set_limits(limits)
    try:
        _stream(results, function, argument)
        last = frames.pack(frames.DONE)
    except BaseException as error:
        traceback.print_exc()
        last = frames.pack(frames.FAILED, pickle.dumps(_failure(error)))
    sys.stdout.flush()
    sys.stderr.flush()
    frames.write_all(results, last)
    os._exit(0)


def _stream(results: int, function: str, argument: bytes) -> None:
    module, _, name = function.partition(":")
    run = getattr(importlib.import_module(module), name)
    for value in run(pickle.loads(argument)):
        frames.write_all(results, frames.pack(frames.MESSAGE, pickle.dumps(value)))


def _failure(error: BaseException) -> tuple[Ending, str]:
    if isinstance(error, ToolDied):
        return ending_of(error.returncode), str(error)
    if isinstance(error, MemoryError):
        return Ending.MEMORY, "ran out of the memory it was allowed"
    return Ending.CRASHED, f"{type(error).__name__}: {error}"


def _set_limits(limits: Limits) -> None:
    _lower(resource.RLIMIT_CORE, 0)
    _lower(resource.RLIMIT_FSIZE, _FILE_BYTES)
    _lower(resource.RLIMIT_DATA, 2 * limits.memory_bytes)
    if limits.cpu_s is not None:
        soft = max(1, math.ceil(limits.cpu_s))
        resource.setrlimit(resource.RLIMIT_CPU, (soft, soft + 1))


def _lower(kind: int, value: int) -> None:
    _, hard = resource.getrlimit(kind)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    resource.setrlimit(kind, (value, value))
