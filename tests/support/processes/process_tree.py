"""Queries about running processes."""

import time

import psutil
from support.waiting import HANG_S

_ENDED = (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD)


def is_alive(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    try:
        return psutil.Process(pid).status() not in _ENDED
    except psutil.NoSuchProcess:
        return False


def is_gone(pid: int, within_s: float = HANG_S) -> bool:
    """Return whether a process ends within `within_s`."""
    until = time.monotonic() + within_s
    while is_alive(pid) and time.monotonic() < until:
        time.sleep(0.01)
    return not is_alive(pid)


def no_job_runs(within_s: float = HANG_S) -> bool:
    """Return whether all processes below this process's launcher end within `within_s`."""
    until = time.monotonic() + within_s
    while (left := below_launcher()) and time.monotonic() < until:
        time.sleep(0.01)
    return not left


def below_launcher() -> list[psutil.Process]:
    """Return the running processes below this process's launcher."""
    return below_launcher_of(psutil.Process())


def below_launcher_of(parent: psutil.Process) -> list[psutil.Process]:
    """Return the running processes below another process's launcher."""
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
