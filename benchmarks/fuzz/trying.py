"""One execution: feed bytes to a reader, and report its fault, if any. Callers make warnings errors."""

from __future__ import annotations

import resource
import time
import traceback

from benchmarks.fuzz.targets import FuzzTarget
from marsupial.errors import InternalError

MOST_CPU_S = 5.0
MOST_BYTES = 500 * 2**20
"""Limits for reading an input: CPU time, and memory beyond the peak before it."""

LONGEST = 65_536
"""Most bytes of an input."""


def fault_of(target: FuzzTarget, data: bytes) -> str | None:
    """Return a reader's fault on `data` as a line; None if the reader accepted or refused it as documented."""
    began, peak = time.process_time(), _peak_bytes()
    try:
        target.read(data)
    except InternalError as error:
        return _said(error)
    except target.refuses:
        pass
    except Exception as error:
        return _said(error)
    if (taken := time.process_time() - began) > MOST_CPU_S:
        return f"took {taken:.1f} s"
    if (grown := _peak_bytes() - peak) > MOST_BYTES:
        return f"took {grown / 2**20:.0f} MiB"
    return None


def _said(error: Exception) -> str:
    """Return the name of an exception and the last lines of the project in its traceback."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "site-packages" not in frame.filename]
    places = [f"{frame.filename.rpartition('/marsupial')[2]}:{frame.lineno}" for frame in frames[-3:]]
    return f"{type(error).__name__} at {' > '.join(places)}: {' '.join(str(error).split())[:300]}"


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
