"""Text files somebody named, and errors that say which file they are about."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from marsupial.errors import InputError
from marsupial.formats.files import file_fault

MOST_BYTES = 256 * 1024 * 1024


def read_text(path: Path, error: type[InputError]) -> str:
    """Return the text of a file.

    Raises
    ------
    InputError
        Of kind `error`, if it can't be read as UTF-8 text.
    """
    fault = file_fault(path, MOST_BYTES)
    if fault is None:
        try:
            return path.read_text(encoding="utf-8-sig")
        except UnicodeDecodeError:
            fault = "is not UTF-8 text"
        except OSError as failure:
            fault = f"can't be read ({failure.strerror})"
    raise error(fault, source=str(path))


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Name the file in every problem found inside."""
    try:
        yield
    except InputError as error:
        raise type(error)(error.problems, source=str(path)) from error
