"""Read and write files that a user named: problems in a few words, and files written whole or not at all.

A path from outside may be missing, a directory, a pipe that never ends, or a file far too big. So it is checked before
it is opened, and never more than the limit is read.
"""

import codecs
import errno
import io
import os
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from marsupial.errors import InputError, MapError, Problem, UsageError

NO_SUCH_FILE = "no such file"

MOST_BYTES = 256 * 1024 * 1024

# byte order marks, the longer before the shorter that they begin with, and the encoding to convert from
_MARKS = (
    (codecs.BOM_UTF8, ""),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)

MAX_PROBLEMS = 10  # most faults of a map file to report: a file with more is probably of another kind


def file_fault(path: Path, limit_bytes: int | None = None) -> str | None:
    """Return why `path` can't be read as a file of at most `limit_bytes`, or None."""
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


def at_home(path: Path | str) -> Path:
    """Return a path with a leading ``~`` replaced by the home folder: in quotes or in a file, no shell does it."""
    return Path(os.path.expanduser(path))


def nearby(folder: Path, written: str) -> str | None:
    """Return how to write the path, from `folder`, of the file that a wrong path probably means; None without one.

    Files come from other machines: a path in them may begin with folders that are missing here or with ``~``, have
    backslashes, or capitals in other places.
    """
    parts = [part for part in written.replace("\\", "/").split("/") if part not in ("", ".", "~")]
    for start in range(len(parts)):
        found = folder
        for part in parts[start:]:
            found = _entry(found, part)
        if os.path.isfile(found):
            return os.path.relpath(found, folder)
    return None


def _entry(folder: Path, name: str) -> Path:
    """Return the entry of a folder with a name, in other capitals if need be; it may be missing."""
    if not os.path.exists(folder / name) and os.path.isdir(folder):
        with suppress(OSError):
            return folder / next((one for one in sorted(os.listdir(folder)) if one.lower() == name.lower()), name)
    return folder / name


def read_bytes(path: Path, error: type[InputError], limit_bytes: int = MOST_BYTES) -> bytes:
    """Return the content of a file; raise `error` if it is missing, no regular file, unreadable or too long."""
    fault = file_fault(path, limit_bytes)
    if fault is None:
        try:
            with path.open("rb") as file:
                data = file.read(limit_bytes + 1)  # the file may have grown since it was checked
        except OSError as failure:
            fault = f"can't be read ({reason(failure)})"
        else:
            if len(data) <= limit_bytes:
                return data
            fault = f"has more bytes than the limit of {limit_bytes}"
    raise error(fault, source=str(path))


def read_text(path: Path, error: type[InputError], limit_bytes: int = MOST_BYTES) -> str:
    """Return the text of a file in UTF-8 or UTF-16; see `read_bytes`."""
    data = io.BytesIO(utf8(read_bytes(path, error, limit_bytes)))
    try:
        return io.TextIOWrapper(data, encoding="utf-8").read()
    except UnicodeDecodeError as failure:
        raise error("is not UTF-8 text", source=str(path)) from failure


def utf8(data: bytes) -> bytes:
    """Return the bytes of a text file as UTF-8 without a byte order mark; bytes in no Unicode encoding as they are.

    Shells and editors of Windows write UTF-16, or begin UTF-8 with such a mark.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(encoding, errors="replace").encode() if encoding else data[len(mark) :]
    # without a mark: of the first two characters, which are ASCII in all our files, every other byte is 0
    even, odd = data[0:4:2], data[1:4:2]
    if (even == b"\0\0") == (odd == b"\0\0"):
        return data
    return data.decode("utf-16-be" if even == b"\0\0" else "utf-16-le", errors="replace").encode()


def raise_any(problems: Sequence[Problem], source: str) -> None:
    """Raise a MapError with the first problems and the number of the others; do nothing if there are none."""
    shown, rest = list(problems[:MAX_PROBLEMS]), len(problems) - MAX_PROBLEMS
    if rest > 0:
        shown.append(Problem("", f"and {rest} more faults like these"))
    if shown:
        raise MapError(shown, source=source)


def replace_file(path: Path, data: bytes) -> None:
    """Write a file whole or not at all: write a draft beside it, then move the draft over it."""
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
    """Raise a `UsageError` for an `OSError` inside, while writing to `path`."""
    try:
        yield
    except BrokenPipeError:  # the reader of a pipe has read enough: no error of the user's
        raise
    except OSError as error:
        raise UsageError(f"can't write {path}: {reason(error)}") from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path`, replacing an existing file; raise a `UsageError` if that fails."""
    with writing(path):
        if path.is_dir():
            raise IsADirectoryError(0, "is a directory")
        if path.exists() and not path.is_file():  # /dev/stdout, a pipe: nothing to replace
            path.write_bytes(data)
        else:
            replace_file(path, data)


def write_file(path: Path, text: str) -> None:
    """Write `text` (UTF-8) to `path` as `write_bytes` does."""
    write_bytes(path, text.encode())


def make_folder(path: Path) -> None:
    """Create an output folder if it does not exist; raise a `UsageError` if that fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"can't make the folder {path}: {reason(error)}") from error


@contextmanager
def about(path: Path) -> Iterator[None]:
    """Add the file's name to every problem raised inside."""
    try:
        yield
    except InputError as error:
        raise type(error)(error.problems, source=str(path)) from error


def reason(error: OSError | ValueError) -> str:
    """Return the system's message in lower case."""
    if isinstance(error, OSError) and error.errno == errno.EBADF:
        return "it is closed"
    return str(getattr(error, "strerror", None) or error).lower()
