"""How far a fork server has loaded what jobs need, in a file that its client can read at any time.

A file, unlike a socket, never blocks its writer, and all threads of the client may read it while they wait for replies.
"""

import os
import struct
from typing import NamedTuple

_FORMAT = struct.Struct("=3I")


class Loading(NamedTuple):
    """The requests to load that are done, the functions compiled so far, and how many there are at most."""

    requests: int = 0
    compiled: int = 0
    functions: int = 0

    def __str__(self) -> str:
        return f"compiling, {self.compiled} of {self.functions} functions" if self.functions else "loading libraries"


class _Progress:
    """The state of this process, if it is a fork server: its descendants don't write."""

    file = -1
    owner = 0
    loading = Loading()


def write_to(file: int) -> None:
    """From now on, write how far this process is to an open file."""
    _Progress.file, _Progress.owner = file, os.getpid()


def report_compiling(compiled: int, functions: int) -> None:
    """Report that a function is being compiled after `compiled` others, if this process is a fork server."""
    _write(_Progress.loading._replace(compiled=compiled, functions=functions))


def report_request() -> None:
    """Report that one more request to load is done."""
    _write(_Progress.loading._replace(requests=_Progress.loading.requests + 1))


def read(file: int) -> Loading:
    """Return what was last written to a file."""
    data = os.pread(file, _FORMAT.size, 0)
    return Loading(*_FORMAT.unpack(data)) if data else Loading()


def _write(loading: Loading) -> None:
    if _Progress.owner == os.getpid():
        _Progress.loading = loading
        os.pwrite(_Progress.file, _FORMAT.pack(*loading), 0)
