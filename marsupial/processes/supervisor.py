"""The supervisor of one job, which watches the job's worker and relays between client and worker.

It is forked from the warm, single-threaded fork server (`marsupial.processes.fork_server`), and forks the worker. It
stores the tail of the worker's output, measures its memory, and ends it and all its descendants when a limit is
reached, when the client hangs up, or when the fork server dies. If the worker ends by itself, its remaining descendants
are ended too. The last message to the client says how the job ended.
"""

import gc
import math
import os
import pickle
import resource
import select
import shutil
import signal
import socket
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from typing import NoReturn

from marsupial.processes import channel as frames
from marsupial.processes import reaper
from marsupial.processes.channel import Channel
from marsupial.processes.jobs import GRACE_S, Ended, Ending, Job, JobLimits, JobOrder, ToolDied, ending_of, exit_text

_Source = Channel | int

TAIL_BYTES = 4096
_POLL_S = 0.05
_QUICK_POLL_S = 0.002
_LONGEST_POLL_S = 0.2
"""Longest polling interval for an idle worker: many workers are idle, waiting for reports. Signals do not interrupt the
wait either, so the end of a job may be noticed that late."""

_CHUNK = 1 << 16
_FILE_BYTES = 1 << 30  # largest file that a worker may write

_BACKLOG = 16 << 20
"""Bytes buffered for an end that doesn't read before the supervisor stops reading from the other end."""


def supervise(control: socket.socket, scratch: str) -> NoReturn:
    """Run the job received over `control` and exit the process; files go into a folder below `scratch`."""
    code = 70
    try:
        gc.freeze()
        reaper.adopt_orphans()
        client = Channel(control)
        frame = client.receive_frame()
        if frame is not None:
            order: JobOrder = pickle.loads(frame[1])
            folder = tempfile.mkdtemp(prefix="job-", dir=scratch)
            try:
                _Supervisor(client, folder, order).run()
            finally:
                reaper.end_below(os.getpid(), 0.0)
                shutil.rmtree(folder, ignore_errors=True)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


class _Supervisor:
    """Watches one worker; `run` returns once all processes of the job have ended and the end was reported."""

    def __init__(self, client: Channel, folder: str, order: JobOrder) -> None:
        self.client = client
        self.limits = order.limits
        self.tail = bytearray()
        self.poll_s = _POLL_S
        self.checked_s = -math.inf
        self.cpu_s: float | None = None
        self.has_no_children = False
        self.failed: tuple[Ending, str] | None = None
        self.done = False
        self.stop: tuple[Ending, str] | None = None
        client.put(frames.START, str(os.getpid()).encode())
        signal.signal(signal.SIGTERM, self._on_term)
        self.started = time.monotonic()
        self.pid, self.worker, self.output = _fork_worker(client, folder, order)
        self.other = {client: self.worker, self.worker: client}
        self.sources: dict[_Source, Callable[[], bool]] = {
            client: self._read_client,
            self.worker: self._read_worker,
            self.output: self._read_output,
        }
        self._relay()  # data received together with the order

    def _on_term(self, *_: object) -> None:
        self.stop = (Ending.KILLED, "the fork server has ended")

    def _end(self, ending: Ending, detail: str) -> None:
        """Request the end of the job, unless it was requested before."""
        self.stop = self.stop or (ending, detail)

    def run(self) -> None:
        """Watch the worker until its end, end its remaining descendants, and report how it ended."""
        returncode = self._watch()
        wall_s = time.monotonic() - self.started
        # before the rest of the output is read, so that no more is written
        returncode = reaper.end_below(os.getpid(), GRACE_S).get(self.pid, returncode)
        # the last output of the worker; no process holds the other ends any longer
        for end, read in ((self.worker, self._read_worker), (self.output, self._read_output)):
            while select.select([end], [], [], 0)[0] and read():
                pass
        self.client.send_frame(frames.ENDED, pickle.dumps(self._result(returncode, wall_s)))

    def _watch(self) -> int | None:
        while self.stop is None:
            left = self.started + self.limits.wall_s - time.monotonic()
            poll_s = self.poll_s if self.worker in self.sources else _QUICK_POLL_S  # it is about to end
            self._relay_available(max(0.0, min(poll_s, left)))
            ended = reaper.reap()
            if self.pid in ended:
                return ended[self.pid]
            if time.monotonic() - self.started >= self.limits.wall_s:
                self._end(Ending.TIMEOUT, f"stopped at its limit of {self.limits.wall_s:g} s")
            if time.monotonic() - self.checked_s >= _POLL_S and not self._is_idle():
                self._check_memory()
        return None

    def _relay_available(self, wait_s: float) -> None:
        """Wait for data and relay it; an end that sends faster than the other one reads has to wait."""
        full = [channel for channel, other in self.other.items() if other.unsent >= _BACKLOG]
        listening = [source for source in self.sources if source not in full]
        sending = [channel for channel in self.other if channel.unsent]
        readable, _, _ = select.select(listening, sending, [], wait_s)
        for source in readable:
            if not self.sources[source]():
                del self.sources[source]
        if self.worker.unsent:
            self.worker.flush()
        if self.client.unsent and not self.client.flush():
            self._end(Ending.CANCELLED, "the client has disconnected")

    def _is_idle(self) -> bool:
        """Return whether the worker has no descendants and was idle since the last poll; if so, poll less often."""
        cpu_s, earlier_s = reaper.cpu_s(self.pid), self.cpu_s
        is_idle = self.has_no_children and cpu_s is not None and cpu_s == earlier_s
        self.cpu_s = cpu_s
        self.poll_s = min(2 * self.poll_s, _LONGEST_POLL_S) if is_idle else _POLL_S
        return is_idle

    def _check_memory(self) -> None:
        below, allowed = reaper.descendants(os.getpid()), self.limits.memory_bytes
        used = reaper.resident_bytes(below)
        self.has_no_children, self.checked_s = below == [self.pid], time.monotonic()
        if allowed is not None and used > allowed:
            self._end(
                Ending.MEMORY, f"stopped with {used >> 20} MiB in use, more than the limit of {allowed >> 20} MiB"
            )

    def _read_output(self) -> bool:
        chunk = os.read(self.output, _CHUNK)
        self.tail += chunk
        del self.tail[:-TAIL_BYTES]
        return bool(chunk)

    def _read_client(self) -> bool:
        is_open = self.client.fill()
        self._relay()
        if not is_open:
            self._end(Ending.CANCELLED, "cancelled by the client")
        return is_open

    def _relay(self) -> None:
        for tag, payload in self.client.frames():
            self.worker.put(tag, payload)
        self.poll_s = _POLL_S

    def _read_worker(self) -> bool:
        is_open = self.worker.fill()
        try:
            for tag, payload in self.worker.frames():
                if tag == frames.MESSAGE:
                    self.client.put(tag, payload)
                elif tag == frames.FAILED:
                    self.failed = pickle.loads(payload)
                elif tag == frames.DONE:
                    self.done = True
        except frames.FrameTooBig as error:
            self._end(Ending.CRASHED, str(error))
            return False
        return is_open

    def _result(self, returncode: int | None, wall_s: float) -> Ended:
        output = self.tail.decode(errors="replace")
        if self.stop is not None:
            ending, detail = self.stop
        elif self.failed is not None:
            ending, detail = self.failed
        elif self.done and returncode == 0:
            ending, detail = Ending.FINISHED, "finished"
        else:
            code = 0 if returncode is None else returncode
            ending, detail = ending_of(code, output), f"its process {exit_text(code)}"
        return Ended(ending=ending, detail=detail, output=output, wall_s=wall_s)


def _fork_worker(client: Channel, folder: str, order: JobOrder) -> tuple[int, Channel, int]:
    """Fork the worker and return its process id, the channel to it, and the read end of its output."""
    ours, theirs = socket.socketpair()
    output, output_in = os.pipe()
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        try:
            # a worker that signals its process group must not reach its supervisor
            os.setsid()
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            reaper.die_with_parent(parent, signal.SIGKILL)
            client.close()
            ours.close()
            os.close(output)
            os.dup2(output_in, 1)
            os.dup2(output_in, 2)
            os.close(output_in)
            _work(Channel(theirs), folder, order)
        finally:
            os._exit(71)
    theirs.close()
    os.close(output_in)
    return pid, Channel(ours), output


def _work(channel: Channel, folder: str, order: JobOrder) -> NoReturn:
    """Do the job and exit the process; its files go into `folder`."""
    sys.path[:] = order.path
    os.environ["TMPDIR"] = tempfile.tempdir = folder
    _set_limits(order.limits)
    tag, payload = frames.DONE, b""
    try:
        job: Job = pickle.loads(order.job)
        if job.talks:
            job.function(job.argument, channel)
        else:
            for value in job.function(job.argument) or ():
                channel.send(value)
    except BaseException as error:
        traceback.print_exc()
        tag, payload = frames.FAILED, pickle.dumps(_failure(error))
    sys.stdout.flush()
    sys.stderr.flush()
    channel.send_frame(tag, payload)
    os._exit(0)


def _failure(error: BaseException) -> tuple[Ending, str]:
    if isinstance(error, ToolDied):
        return ending_of(error.returncode), str(error)
    if isinstance(error, MemoryError):
        return Ending.MEMORY, "exceeded its memory limit"
    return Ending.CRASHED, f"{type(error).__name__}: {error}"


def _set_limits(limits: JobLimits) -> None:
    _lower(resource.RLIMIT_CORE, 0)
    _lower(resource.RLIMIT_FSIZE, _FILE_BYTES)
    if limits.memory_bytes is not None:
        _lower(resource.RLIMIT_DATA, 2 * limits.memory_bytes)
    if limits.cpu_s is not None:
        soft = max(1, math.ceil(limits.cpu_s))
        resource.setrlimit(resource.RLIMIT_CPU, (soft, soft + 1))


def _lower(kind: int, value: int) -> None:
    _, hard = resource.getrlimit(kind)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    resource.setrlimit(kind, (value, value))
