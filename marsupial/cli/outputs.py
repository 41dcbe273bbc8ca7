"""Files that are written whole or not at all.

A file is written beside its place under another name and moved there at the end: a reader sees the old file or the
new one, never half of it.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from marsupial.errors import UsageError


def write_file(path: Path, text: str) -> None:
    """Write `text` (UTF-8) to `path`, replacing what is there.

    Raises
    ------
    UsageError
        If it can't be written there.
    """
    with writing(path):
        _replace(path, text)


def make_folder(path: Path) -> None:
    """Make a folder to write to, if it isn't there.

    Raises
    ------
    UsageError
        If it can't be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"can't make the folder {path}: {_reason(error)}") from error


@contextmanager
def writing(path: Path | str) -> Iterator[None]:
    """Turn what the system says against writing to `path` inside into a `UsageError`."""
    try:
        yield
    except BrokenPipeError:  # who reads has read enough
        raise
    except OSError as error:
        raise UsageError(f"can't write {path}: {_reason(error)}") from error


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()


def _replace(path: Path, text: str) -> None:
    if path.is_dir():
        raise IsADirectoryError(0, "is a directory")
    if path.exists() and not path.is_file():  # /dev/stdout, a pipe: nothing to replace
        path.write_text(text, encoding="utf-8")
        return
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with open(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
        os.chmod(name, 0o666 & ~_umask())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
