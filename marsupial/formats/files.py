"""Files by their paths: what can be wrong with one that is to be read, and writing one whole or not at all.

A path from outside may be missing, a directory, a pipe that never ends or far too big. It is looked at before it
is opened, and never more than the limit is read.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from marsupial.errors import MapError, Problem


def file_fault(path: Path, limit_bytes: int | None = None) -> str | None:
    """Say what keeps `path` from being read as a file of at most `limit_bytes`, or None where nothing does."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return "no such file"
    except (OSError, ValueError) as error:
        return f"can't be read ({_reason(error)})"
    if stat.S_ISDIR(status.st_mode):
        return "is a directory, not a file"
    if not stat.S_ISREG(status.st_mode):
        return "is not a regular file"
    if limit_bytes is not None and status.st_size > limit_bytes:
        return f"has {status.st_size} bytes, more than the limit of {limit_bytes}"
    return None if os.access(path, os.R_OK) else "can't be read (permission denied)"


def read_map_bytes(path: Path, limit_bytes: int) -> bytes:
    """Return the content of a map file.

    Raises
    ------
    MapError
        Where the file is missing, no regular file, unreadable or longer than `limit_bytes`.
    """
    fault = file_fault(path, limit_bytes)
    if fault is None:
        try:
            with path.open("rb") as file:
                data = file.read(limit_bytes + 1)
        except OSError as error:
            fault = f"can't be read ({_reason(error)})"
        else:
            if len(data) <= limit_bytes:
                return data
            fault = f"has more bytes than the limit of {limit_bytes}"
    raise MapError([Problem("", fault)], source=str(path))


def replace_file(path: Path, data: bytes) -> None:
    """Write a file whole or not at all: beside its place first, then moved there."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        with draft.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def _reason(error: OSError | ValueError) -> str:
    return str(getattr(error, "strerror", None) or error).lower()
