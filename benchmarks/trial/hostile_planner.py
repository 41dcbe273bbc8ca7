"""A planner that misbehaves, run by path as an external planner: ``hostile_planner.py KIND DOMAIN PROBLEM``.

It needs only the standard library. The paths on the command lines of its processes show to which job they belong.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable

FOREVER_S = 600.0


def sleep() -> None:
    """Sleep."""
    time.sleep(FOREVER_S)


def ignore_term() -> None:
    """Ignore termination signals, and work."""
    for signum in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(signum, signal.SIG_IGN)
    while True:
        sum(range(1000))


def fork() -> None:
    """Start children that ignore SIGTERM, and sleep."""
    for _ in range(8):
        if os.fork() == 0:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            sleep()
    sleep()


def setsid() -> None:
    """Start a grandchild in its own session, without open files, and sleep."""
    _escape()
    sleep()


def leave_behind() -> None:
    """Start such grandchildren, and exit at once as if successful."""
    for _ in range(4):
        _escape()


def allocate() -> None:
    """Allocate memory until none is left."""
    held = []
    while True:
        held.append(bytearray(os.urandom(1)) * (8 << 20))


def flood() -> None:
    """Print without end."""
    chunk = b"; " + b"flood " * 10_000 + b"\n"
    while True:
        os.write(1, chunk)


def flood_errors() -> None:
    """Print invalid plans without end, and errors in one endless line."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    while True:
        os.write(1, b"0.0: (explore nobody nowhere) [1.0]\n" * 1000)
        os.write(2, b"x" * 50_000)


def mute() -> None:
    """Close everything, and sleep."""
    os.closerange(0, 256)
    sleep()


def leave() -> None:
    """Exit at once, without output."""


def fail() -> None:
    """Exit at once with an error code."""
    sys.exit(3)


def crash() -> None:
    """Die of a signal."""
    os.kill(os.getpid(), signal.SIGSEGV)
    sleep()


def _escape() -> None:
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            os.closerange(0, 256)
            sleep()
        os._exit(0)
    with contextlib.suppress(ChildProcessError):
        os.wait()


KINDS: dict[str, Callable[[], None]] = {
    "sleep": sleep,
    "ignore-term": ignore_term,
    "fork": fork,
    "setsid": setsid,
    "leave-behind": leave_behind,
    "allocate": allocate,
    "flood": flood,
    "flood-errors": flood_errors,
    "mute": mute,
    "leave": leave,
    "fail": fail,
    "crash": crash,
}

if __name__ == "__main__":
    KINDS[sys.argv[1]]()
