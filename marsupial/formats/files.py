"""Files named by a user: what can be wrong with them, said in a few words, and writing them whole or not at all.

A path from outside may be missing, a directory, a pipe that never ends or far too big. It is looked at before it
is opened, and never more than the limit is read.
"""

from __future__ import annotations

import errno
import io
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from marsupial.errors import InputError, UsageError

NO_SUCH_FILE = "no such file"

MOST_BYTES = 256 * 1024 * 1024


def file_fault(path: Path, limit_bytes: int | None = None) -> str | None:
    """Say what keeps `path` from being read as a file of at most `limit_bytes`, or None where nothing does."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return NO_SUCH_FILE
    except (OSError, ValueError) as error:
        return f"can't be read ({reason(error)})"
    if stat.S_ISDIR(status.st_mode):
        return "is a directory, not a file"
    if not stat.S_ISREG(status.st_mode):
        return "is not a regular file"
    if limit_bytes is not None and status.st_size > limit_bytes:
        return f"has {status.st_size} bytes, more than the limit of {limit_bytes}"
    return None if os.access(path, os.R_OK) else "can't be read (permission denied)"


def read_bytes(path: Path, error: type[InputError], limit_bytes: int = MOST_BYTES) -> bytes:
    """Return the content of a file.

    Raises
    ------
    InputError
        Of kind `error`, where the file is missing, no regular file, unreadable or longer than `limit_bytes`.
    """
    fault = file_fault(path, limit_bytes)
    if fault is None:
        try:
            with path.open("rb") as file:
                data = file.read(limit_bytes + 1)
        except OSError as failure:
            fault = f"can't be read ({reason(failure)})"
        else:
            if len(data) <= limit_bytes:
                return data
            fault = f"has more bytes than the limit of {limit_bytes}"
    raise error(fault, source=str(path))


def read_text(path: Path, error: type[InputError], limit_bytes: int = MOST_BYTES) -> str:
    """Return the text of a file, as `read_bytes`; it has to be UTF-8."""
    data = io.BytesIO(read_bytes(path, error, limit_bytes))
    try:
        return io.TextIOWrapper(data, encoding="utf-8-sig").read()
    except UnicodeDecodeError as failure:
        raise error("is not UTF-8 text", source=str(path)) from failure


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


@contextmanager
def writing(path: Path | str) -> Iterator[None]:
    """Turn what the system says against writing to `path` inside into a `UsageError`."""
    try:
        yield
    except BrokenPipeError:  # who reads has read enough
        raise
    except OSError as error:
        raise UsageError(f"can't write {path}: {reason(error)}") from error


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Name the file in every problem found inside."""
    try:
        yield
    except InputError as error:
        raise type(error)(error.problems, source=str(path)) from error


def reason(error: OSError | ValueError) -> str:
    """Return what the system says is wrong, in small letters."""
    if isinstance(error, OSError) and error.errno == errno.EBADF:
        return "it is closed"
    return str(getattr(error, "strerror", None) or error).lower()
