"""The values that pass between the client of a job in a child process and the processes that run it.

A job is a function of some module's top level and one argument; both are pickled, so the child imports the function.
Every value it yields is streamed back at once, or it gets the channel and talks to the client. A run ends with one
`Ended`, which distinguishes finished, crashed, killed by another process, out of memory and timed out.
"""

import math
import signal
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

GIB = 1 << 30

GRACE_S = 0.1
"""Time between SIGTERM and SIGKILL."""


class Ending(StrEnum):
    """Why a job ended."""

    FINISHED = "finished"
    CRASHED = "crashed"  # an exception, a signal of its own making, or an exit code
    KILLED = "killed"  # by another process
    CANCELLED = "cancelled"  # by its client
    MEMORY = "memory"
    TIMEOUT = "timeout"


@dataclass(frozen=True, slots=True, kw_only=True)
class JobLimits:
    """Limits of a job and all its descendants; None for no limit."""

    wall_s: float = math.inf  # wall-clock seconds from the start of the job's process
    # resident memory of all its processes together, measured about 20 times a second (5 times while a single process
    # rests). A hard limit of twice as much on the data of each process stops faster allocation.
    memory_bytes: int | None = 2 * GIB
    cpu_s: float | None = None  # processor seconds per process, rounded up to whole ones


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One piece of work."""

    # takes the argument and generates the values to send back; with `talks`, it takes the argument and the worker's
    # `Channel`, and sends and receives values until it returns
    function: Callable[..., Iterable[object] | None]
    argument: object  # any picklable value
    limits: JobLimits
    talks: bool = False


class JobOrder(NamedTuple):
    """The supervisor's order; only the worker unpickles the job, which imports its function by that path."""

    limits: JobLimits
    path: list[str]
    job: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """A value that the job sent, `elapsed_s` seconds after the request for the job."""

    value: object
    elapsed_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """The end of a job."""

    ending: Ending
    detail: str  # one sentence for users
    output: str = ""  # the last few kilobytes that the job's processes wrote to stdout and stderr
    wall_s: float = 0.0


class ToolDied(Exception):
    """Raised inside a job whose own child program died: `returncode` decides how the job ended."""

    def __init__(self, name: str, returncode: int) -> None:
        super().__init__(f"{name} {exit_text(returncode)}")
        self.returncode = returncode


_EXTERNAL_SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
_OUT_OF_MEMORY = ("bad_alloc", "memory allocation of", "out of memory", "MemoryError")


def exit_text(returncode: int) -> str:
    """Return in words how a process ended; `returncode` is that of `subprocess`: minus the number of a signal."""
    if returncode >= 0:
        return f"ended with exit code {returncode}"
    known = -returncode in set(signal.Signals)
    return f"was ended by signal {signal.Signals(-returncode).name if known else -returncode}"


def ending_of(returncode: int, output: str = "") -> Ending:
    """Return the ending of a job that was not stopped, from its process's return code and last output."""
    if -returncode in _EXTERNAL_SIGNALS:
        return Ending.KILLED
    if returncode == -signal.SIGXCPU:
        return Ending.TIMEOUT
    if returncode != 0 and any(sign in output for sign in _OUT_OF_MEMORY):
        return Ending.MEMORY
    return Ending.CRASHED
