"""The fork server: a clean, single-threaded Python process that forks one supervisor per job.

It loads the libraries of jobs once, so that a job starts in milliseconds instead of seconds, and its client process,
which may have threads, never forks. It ends with all its descendants when the client closes the socket or dies. If a
supervisor is killed, the fork server inherits its orphaned descendants and ends them.
"""

import contextlib
import gc
import os
import pickle
import select
import shutil
import signal
import socket
import sys
import tempfile
from collections.abc import Iterator

from marsupial.processes import loading, reaper
from marsupial.processes.channel import START, Channel
from marsupial.processes.supervisor import supervise

NEW_JOB, PRELOAD = b"J", b"P"
"""Requests, each over a channel of its own: to run a job, or to call functions that load something."""

_POLL_S = 0.2


def main(fd: int, client: int, progress: int) -> None:
    """Serve the requests of process `client` over the socket `fd`, until the socket is closed or `client` has died.

    `progress` is the file for how far it has loaded what jobs need.
    """
    loading.write_to(progress)
    reaper.adopt_orphans()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    scratch = tempfile.mkdtemp(prefix="marsupial-")
    try:
        with socket.socket(fileno=fd) as line:
            _serve(line, client, scratch)
    except SystemExit:
        pass
    finally:
        reaper.end_below(os.getpid(), 1.0)
        shutil.rmtree(scratch, ignore_errors=True)


def _serve(line: socket.socket, client: int, scratch: str) -> None:
    supervisors: set[int] = set()
    loaded: set[bytes] = set()
    while os.getppid() == client:
        ready, _, _ = select.select([line], [], [], _POLL_S)
        supervisors -= reaper.reap().keys()
        for pid in reaper.children(os.getpid()):
            if pid not in supervisors:  # orphaned by a supervisor that was killed: we did not start it
                reaper.kill(pid)
        if not ready:
            continue
        request, fds, _, _ = socket.recv_fds(line, 1, 1)
        if not request:
            return
        for fd in fds:
            if request == PRELOAD:
                with _exiting_with_client(client):
                    _preload(Channel(socket.socket(fileno=fd)), loaded)
            else:
                supervisors.add(_fork_supervisor(line, fd, scratch))


def _preload(client: Channel, loaded: set[bytes]) -> None:
    """Call the received pickled functions that were not called before, and reply.

    If a function can't be unpickled or called, the job that needs it reports the error.
    """
    frame = client.receive_frame()
    for call in [] if frame is None else pickle.loads(frame[1]):
        if call not in loaded:
            loaded.add(call)
            try:
                pickle.loads(call)()
            except Exception as error:
                print(f"preloading failed: {error}", flush=True)
    gc.collect()
    # the garbage collector never scans loaded objects again, so their pages stay shared with workers
    gc.freeze()
    loading.report_request()
    client.send_frame(START)
    client.close()


@contextlib.contextmanager
def _exiting_with_client(client: int) -> Iterator[None]:
    """Exit when `client` dies, even during an import."""

    def check(*_: object) -> None:
        if os.getppid() != client:
            raise SystemExit

    signal.signal(signal.SIGALRM, check)
    signal.setitimer(signal.ITIMER_REAL, _POLL_S, _POLL_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _fork_supervisor(line: socket.socket, fd: int, scratch: str) -> int:
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        line.close()
        reaper.die_with_parent(parent, signal.SIGTERM)
        supervise(socket.socket(fileno=fd), scratch)
    os.close(fd)
    return pid
