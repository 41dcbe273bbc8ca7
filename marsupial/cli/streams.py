"""stdout and stderr as shells hand them over: closed, full, or read by somebody who leaves early."""

from __future__ import annotations

import os
import sys
from typing import TextIO

from marsupial.cli.display.messages import complain
from marsupial.cli.exit_codes import DONE, READER_LEFT, USAGE
from marsupial.formats.files import reason


def open_closed() -> None:
    """Open stdout and stderr where they are closed, lest the next file that is opened takes their place.

    What is written to stdout is refused then, as by a full disk; what is told on stderr is dropped.
    """
    for number, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # takes the lowest number that is free: this one
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)


def fault_of(stream: TextIO) -> OSError | None:
    """Return what the system says against what is left to be written to a stream."""
    try:
        stream.flush()
    except OSError as error:
        return error
    return None


def settled(code: int) -> int:
    """Return the exit code, once all is written; what can't be is dropped, so that Python doesn't try again."""
    for stream in (sys.stdout, sys.stderr):
        fault = fault_of(stream)
        if fault is None:
            continue
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        if isinstance(fault, BrokenPipeError):
            code = READER_LEFT
        elif stream is sys.stdout and code == DONE:
            complain(f"error: can't write to stdout: {reason(fault)}")
            code = USAGE
    return code
