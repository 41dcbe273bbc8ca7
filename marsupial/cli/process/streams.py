"""stdout and stderr in the state shells pass them: possibly closed, full, or with a reader that leaves early."""

from __future__ import annotations

import os
import sys
from typing import TextIO

from marsupial.cli.display.messages import complain
from marsupial.cli.process.exit_codes import DONE, READER_LEFT, USAGE
from marsupial.formats.files import reason


def open_closed() -> None:
    """Reopen closed standard streams, so that the next opened file does not take their place."""
    # Writing to stdout fails then, as on a full disk; messages on stderr are dropped.
    for number, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # takes the lowest free number, which is this one
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)


def fault_of(stream: TextIO) -> OSError | None:
    """Flush a stream; return the error if that fails."""
    try:
        stream.flush()
    except OSError as error:
        return error
    return None


def settled(code: int) -> int:
    """Flush both streams and return the exit code; drop unwritable output, so that Python does not retry at exit."""
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
