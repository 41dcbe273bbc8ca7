"""What passes between those who ask for a job in a child process and those who run it.

A job is a function of some module's top level and one argument; both are pickled, so the child imports the function.
Every value it yields is streamed back as it comes, or it is given the channel and talks with the asker. A run ends with
one `Ended`, which tells finished, crashed, killed by another process, out of memory and out of time apart.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum

GIB = 1 << 30

GRACE_S = 0.1
"""How long processes have between being asked to end and being killed."""


class Ending(StrEnum):
    """Why a job is over."""

    FINISHED = "finished"
    CRASHED = "crashed"  # an exception, a signal of its own making, or an exit code
    KILLED = "killed"  # by another process
    CANCELLED = "cancelled"  # by the one who asked for it
    MEMORY = "memory"
    TIMEOUT = "timeout"


@dataclass(frozen=True, slots=True, kw_only=True)
class JobLimits:
    """What a job and all its descendants may use.

    Parameters
    ----------
    wall_s
        Wall-clock seconds from the start of the job's process.
    memory_bytes
        Resident memory of all its processes together, measured about 20 times a second; of a single process that
        rests it is looked 5 times a second whether it still does. Each process alone also
        gets twice as much as a hard limit on its data, which stops what allocates faster than that. None for no limit.
    cpu_s
        Processor seconds per process, rounded up to whole ones; None for no limit.
    """

    wall_s: float = math.inf
    memory_bytes: int | None = 2 * GIB
    cpu_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One piece of work.

    Parameters
    ----------
    function
        Takes the argument and is a generator of the values to be sent back; one that `talks` takes the argument and
        the worker's `Channel`, by which it sends and receives values until it returns.
    argument
        Anything that can be pickled.
    """

    function: Callable[..., Iterable[object] | None]
    argument: object
    limits: JobLimits
    talks: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """A value the job sent, `elapsed_s` seconds after the job was asked for."""

    value: object
    elapsed_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """The end of a job.

    Parameters
    ----------
    detail
        One sentence for people.
    output
        The last few kilobytes the job's processes wrote to stdout and stderr.
    wall_s
        How long it ran.
    peak_bytes
        Most resident memory measured.
    """

    ending: Ending
    detail: str
    output: str = ""
    wall_s: float = 0.0
    peak_bytes: int = 0


class ToolDied(Exception):
    """Raised inside a job whose own child program died; it decides how the job ended.

    Parameters
    ----------
    name
        What the program is called.
    returncode
        As `subprocess` gives it: an exit code, or minus the number of a signal.
    """

    def __init__(self, name: str, returncode: int) -> None:
        super().__init__(f"{name} {death(returncode)}")
        self.returncode = returncode


_FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
_OUT_OF_MEMORY = ("bad_alloc", "memory allocation of", "out of memory", "MemoryError")


def death(returncode: int) -> str:
    """Say in words how a process ended; `returncode` as `subprocess` gives it."""
    if returncode >= 0:
        return f"ended with exit code {returncode}"
    try:
        return f"was ended by signal {signal.Signals(-returncode).name}"
    except ValueError:
        return f"was ended by signal {-returncode}"


def ending_of(returncode: int, output: str = "") -> Ending:
    """Return how a job ended whose process nobody of us stopped, from its return code and last output."""
    if -returncode in _FROM_OUTSIDE:
        return Ending.KILLED
    if returncode == -signal.SIGXCPU:
        return Ending.TIMEOUT
    if returncode != 0 and any(sign in output for sign in _OUT_OF_MEMORY):
        return Ending.MEMORY
    return Ending.CRASHED
