"""Find, measure and end every process below one process.

On Linux a supervisor declares itself *subreaper*: a descendant whose parent dies, even one that has started a session
of its own, becomes its child. So all descendants of a job stay below its supervisor and can be found. To end processes,
it sends TERM, waits for a grace period, then sends KILL until none is left.
"""

import contextlib
import ctypes
import os
import signal
import sys
import time
from itertools import product
from pathlib import Path

import psutil

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_POLL_S = 0.005
_PATIENCE_S = 5.0  # longest wait for processes that even SIGKILL does not end at once
_PROC = os.path.exists("/proc/self/task")
_PAGE = os.sysconf("SC_PAGE_SIZE") if _PROC else 0


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(option, value, 0, 0, 0)


def adopt_orphans() -> None:
    """Become the parent of every orphaned descendant (Linux; elsewhere nothing happens)."""
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def die_with_parent(parent: int, signum: int) -> None:
    """Receive `signum` when our single-threaded parent process `parent` ends (Linux)."""
    _prctl(_PR_SET_PDEATHSIG, signum)
    if os.getppid() != parent:
        os.kill(os.getpid(), signum)


def children(pid: int) -> list[int]:
    """Return the child process ids of `pid`, zombies included; read from /proc where it exists, as that is cheap."""
    if not _PROC:
        with contextlib.suppress(psutil.NoSuchProcess):
            return [child.pid for child in psutil.Process(pid).children()]
        return []
    found: list[int] = []
    with contextlib.suppress(OSError):  # it ended meanwhile
        for task in Path(f"/proc/{pid}/task").iterdir():
            found += [int(child) for child in (task / "children").read_text().split()]
    return found


def descendants(pid: int) -> list[int]:
    """Return the process ids below `pid`, zombies included, parents before children."""
    found: list[int] = []
    queue = [pid]
    while queue:
        below = children(queue.pop(0))
        found += below
        queue += below
    return found


def resident_bytes(pids: list[int]) -> int:
    """Return the resident memory of these processes, without file-backed shared memory where known."""
    total = 0
    for pid in pids:
        with contextlib.suppress(OSError, psutil.Error):  # it ended meanwhile
            if _PROC:
                _, resident, shared, *_ = Path(f"/proc/{pid}/statm").read_text().split()
                total += (int(resident) - int(shared)) * _PAGE
            else:
                total += int(psutil.Process(pid).memory_info().rss)
    return total


def cpu_s(pid: int) -> float | None:
    """Return the processor seconds that `pid` has used, precise enough to show any activity.

    None if it has ended, or where no such clock exists (Linux has one for each process).
    """
    if sys.platform != "linux":
        return None
    try:
        return time.clock_gettime(~pid << 3 | 2)  # as clock_getcpuclockid(3) computes it
    except OSError:
        return None


def reap() -> dict[int, int]:
    """Reap every ended child of this process; return the return codes (as in `subprocess`) by process id."""
    ended: dict[int, int] = {}
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return ended
        if pid == 0:
            return ended
        ended[pid] = os.waitstatus_to_exitcode(status)


def _signal_all(pids: list[int], *signums: int) -> None:
    for pid, signum in product(pids, signums):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signum)


def kill(pid: int) -> None:
    """Kill `pid` and all its descendants at once."""
    _signal_all([pid, *descendants(pid)], signal.SIGKILL)


def end_below(pid: int, grace_s: float) -> dict[int, int]:
    """End every process below `pid`: TERM, `grace_s` seconds, then KILL until none is left.

    Return the return codes of the reaped children of this process.
    """
    ended: dict[int, int] = {}
    terminated: set[int] = set()
    started = time.monotonic()
    while time.monotonic() - started < _PATIENCE_S:
        ended.update(reap())
        left = descendants(pid)
        if not left:
            break
        if time.monotonic() - started < grace_s:
            # SIGCONT as well: a stopped process handles no SIGTERM
            _signal_all([one for one in left if one not in terminated], signal.SIGTERM, signal.SIGCONT)
            terminated.update(left)
        else:
            _signal_all(left, signal.SIGKILL)
        time.sleep(_POLL_S)
    return ended
