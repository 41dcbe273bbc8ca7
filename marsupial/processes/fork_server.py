"""The launcher: a clean, single-threaded Python process that forks one supervisor per job.

It has imported the slow libraries once, so that a job starts in milliseconds instead of seconds, and the asking
process, which may have threads, never forks. It ends with everything below it when the asker closes its socket or dies;
should a supervisor be killed, what that leaves behind falls to the launcher, which ends it.
"""

from __future__ import annotations

import gc
import importlib
import os
import select
import shutil
import signal
import socket
import tempfile
from collections.abc import Sequence

from marsupial.processes import reaper
from marsupial.processes.supervisor import supervise

READY = b"R"
NEW_JOB = b"J"
_POLL_S = 0.2


def main(fd: int, asker: int, preload: Sequence[str]) -> None:
    """Serve jobs that process `asker` wants over the socket `fd`, until it is closed or its owner has died.

    First `preload` is imported, as far as installed.
    """
    reaper.adopt_orphans()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave)
    _watch(asker)
    for name in preload:
        _import_if_there(name)
    signal.setitimer(signal.ITIMER_REAL, 0)
    gc.collect()
    gc.freeze()
    scratch = tempfile.mkdtemp(prefix="marsupial-")
    try:
        with socket.socket(fileno=fd) as line:
            line.sendall(READY)
            _serve(line, asker, scratch)
    except SystemExit:
        pass
    finally:
        reaper.end_below(os.getpid(), 1.0)
        shutil.rmtree(scratch, ignore_errors=True)


def _leave(*_: object) -> None:
    raise SystemExit


def _watch(asker: int) -> None:
    """Leave when `asker` dies, also in the middle of an import; until the timer is set to 0."""

    def look(*_: object) -> None:
        if os.getppid() != asker:
            raise SystemExit

    signal.signal(signal.SIGALRM, look)
    signal.setitimer(signal.ITIMER_REAL, _POLL_S, _POLL_S)


def _import_if_there(name: str) -> None:
    """Import a library ahead of its use; one that is missing or broken is reported by the job that needs it."""
    try:
        importlib.import_module(name)
    except Exception as error:
        print(f"{name} can't be imported: {error}", flush=True)


def _serve(line: socket.socket, asker: int, scratch: str) -> None:
    supervisors: set[int] = set()
    while os.getppid() == asker:
        ready, _, _ = select.select([line], [], [], _POLL_S)
        supervisors -= reaper.reap().keys()
        _end_strays(supervisors)
        if not ready:
            continue
        data, fds, _, _ = socket.recv_fds(line, 1, 1)
        if not data:
            return
        for fd in fds:
            supervisors.add(_fork_supervisor(line, fd, scratch))


def _fork_supervisor(line: socket.socket, fd: int, scratch: str) -> int:
    parent = os.getpid()
    pid = os.fork()
    if pid == 0:
        line.close()
        reaper.die_with_parent(parent, signal.SIGTERM)
        supervise(socket.socket(fileno=fd), scratch)
    os.close(fd)
    return pid


def _end_strays(supervisors: set[int]) -> None:
    """End what a killed supervisor has left: children of ours that we didn't start."""
    for pid in reaper.children(os.getpid()):
        if pid not in supervisors:
            reaper.kill(pid)
