"""Output files of commands: written completely or not at all; errors become a `UsageError`."""

from __future__ import annotations

from pathlib import Path

from marsupial.errors import UsageError
from marsupial.formats.files import reason, replace_file, writing

__all__ = ["make_folder", "write_bytes", "write_file", "writing"]


def write_file(path: Path, text: str) -> None:
    """Write `text` (UTF-8) to `path` as `write_bytes` does."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path`, replacing an existing file; raise a `UsageError` if that fails."""
    with writing(path):
        if path.is_dir():
            raise IsADirectoryError(0, "is a directory")
        if path.exists() and not path.is_file():  # /dev/stdout, a pipe: nothing to replace
            path.write_bytes(data)
        else:
            replace_file(path, data)


def make_folder(path: Path) -> None:
    """Create an output folder if it does not exist; raise a `UsageError` if that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"can't make the folder {path}: {reason(error)}") from error
