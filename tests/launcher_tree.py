"""The processes that planners run in, as a test sees them from outside."""

from __future__ import annotations

import psutil


def below_launcher() -> list[psutil.Process]:
    """Return what runs below the launcher of this process; a process that ends meanwhile is left out."""
    return [process for process in psutil.Process().children(recursive=True) if _is_planning(process)]


def _is_planning(process: psutil.Process) -> bool:
    try:
        names = [" ".join(parent.cmdline()) for parent in process.parents()]
        alive = process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
    return alive and any("marsupial.processes.fork_server" in name for name in names)
