"""Processes, as a test sees them from outside."""

import time

import psutil
from patience import HANG_S

_ENDED = (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


def is_alive(pid: int) -> bool:
    """Say whether a process runs; one that has ended and was not collected does not."""
    try:
        return psutil.Process(pid).status() not in _ENDED
    except psutil.NoSuchProcess:
        return False


def is_gone(pid: int, within_s: float = HANG_S) -> bool:
    """Say whether a process has ended, or soon does."""
    until = time.monotonic() + within_s
    while is_alive(pid) and time.monotonic() < until:
        time.sleep(0.01)
    return not is_alive(pid)


def nothing_runs(within_s: float = HANG_S) -> bool:
    """Say whether nothing but the launcher of this process runs any more, or soon does."""
    until = time.monotonic() + within_s
    while (left := below_launcher()) and time.monotonic() < until:
        time.sleep(0.01)
    return not left


def below_launcher() -> list[psutil.Process]:
    """Return what runs below the launcher of this process; a process that ends meanwhile is left out."""
    return below_launcher_of(psutil.Process())


def below_launcher_of(parent: psutil.Process) -> list[psutil.Process]:
    """Return the same of another process, nothing if that has ended; what runs on its Ray nodes is not its own."""
    try:
        below = [process for child in parent.children() if _is_launcher(child) for process in _alive_below(child)]
    except psutil.NoSuchProcess:
        return []
    return below


def _is_launcher(process: psutil.Process) -> bool:
    try:
        return "marsupial.processes.fork_server" in " ".join(process.cmdline())
    except psutil.NoSuchProcess:
        return False


def _alive_below(launcher: psutil.Process) -> list[psutil.Process]:
    try:
        return [process for process in launcher.children(recursive=True) if is_alive(process.pid)]
    except psutil.NoSuchProcess:
        return []
