"""Open a recording of ROS 2 (rosbag2) in each shape in which recorders, copies and crashes leave one.

A recording is a folder with a `metadata.yaml`; that file itself; a file of storage (`.mcap`, `.db3`) alone, or in a
folder without metadata, as a recorder that was killed leaves it; or such a file compressed (`.mcap.zstd`). A topic may
follow a ``#`` (``run7#/carrier1/map``).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from marsupial.errors import MapError
from marsupial.formats.files import file_fault

if TYPE_CHECKING:
    from rosbags.rosbag2 import Reader

SUFFIXES = (".mcap", ".db3")
COMPRESSED = tuple(suffix + packed for suffix in SUFFIXES for packed in (".zstd", ".zst"))
METADATA = "metadata.yaml"

# the most that a compressed file may become on the disk: a few kilobytes can become terabytes
MOST_UNPACKED_BYTES = 8 * 2**30
_PART_BYTES = 2**20


def is_recording(path: Path) -> bool:
    """Return whether a path is meant as a recording: a folder or file of one."""
    if os.path.isdir(path):  # False for impossible names, for which `Path.is_dir` raises
        return os.path.isfile(path / METADATA) or bool(_storage_in(path))
    return path.name.lower().endswith((*SUFFIXES, *COMPRESSED)) or _is_metadata(path)


def split_topic(path: Path) -> tuple[Path, str | None]:
    """Return the recording that a path names, and the topic after it, if any; a path that exists has none."""
    recording, mark, topic = str(path).rpartition("#")  # a topic has no #, a folder may
    if not mark or os.path.exists(path) or not is_recording(Path(recording)):
        return path, None
    return Path(recording), "/" + topic.lstrip("/")


def size_of(recording: Path) -> int:
    """Return the bytes of a recording on the disk."""
    folder = recording.parent if _is_metadata(recording) else recording
    files = folder.iterdir() if folder.is_dir() else (folder,)
    return sum(file.stat().st_size for file in files)


@contextmanager
def opened(recording: Path) -> Iterator[Reader]:
    """Open a recording. Raises MapError if it can't be read, also for errors while it is read."""
    try:
        from rosbags.rosbag2 import Reader
    except ImportError as error:
        text = f"a recording of ROS 2 needs {error.name}: pip install 'marsupial[ros]'"
        raise MapError(text, source=str(recording)) from error
    found = _found(recording)
    try:
        with _unpacked(found) as path, Reader(path) as reader:
            yield reader
    except MapError:
        raise
    except Exception as error:  # a damaged file may raise from SQLite, YAML, MCAP, LZ4, Zstandard or CDR
        text = " ".join(str(error).split()) or type(error).__name__
        advice = f"`ros2 bag reindex {found}`" if found.is_dir() else f"`mcap recover {found}`"
        hint = "" if found.suffix == ".db3" else f"; if its recorder was killed, {advice} may repair it"
        fault = f"is no recording of ROS 2 that can be read ({text}){hint}"
        raise MapError(fault, source=str(recording)) from error


def _found(recording: Path) -> Path:
    """Return the folder with metadata, or the one file, of a recording. Raises MapError if there is neither."""
    if _is_metadata(recording):
        return recording.parent
    if not recording.is_dir():
        if (fault := file_fault(recording)) is not None:
            raise MapError(fault, source=str(recording))
        return recording
    if (recording / METADATA).is_file():
        return recording
    files = _storage_in(recording)
    if len(files) == 1:
        return files[0]
    fault = (
        f"has no {METADATA}, but {len(files)} files ({', '.join(file.name for file in files[:4])}): "
        f"name one of them, or write it with `ros2 bag reindex {recording}`"
        if files
        else f"is a directory, not a file, and holds no recording of ROS 2 ({METADATA}, {', '.join(SUFFIXES)})"
    )
    raise MapError(fault, source=str(recording))


def _storage_in(folder: Path) -> list[Path]:
    try:
        files = sorted(folder.iterdir())
    except OSError:
        return []
    return [file for file in files if file.name.lower().endswith((*SUFFIXES, *COMPRESSED)) and file.is_file()]


def _is_metadata(path: Path) -> bool:
    """Return whether a file is the metadata of a recording: a nav2 map may have that name too."""
    if path.name != METADATA or file_fault(path) is not None:
        return False
    with path.open("rb") as file:
        return b"rosbag2_bagfile_information" in file.read(_PART_BYTES)


@contextmanager
def _unpacked(path: Path) -> Iterator[Path]:
    """Give a recording as it is, or a compressed file of one as a temporary file of at most MOST_UNPACKED_BYTES."""
    if not path.name.lower().endswith(COMPRESSED):
        yield path
        return
    try:
        from compression import zstd  # type: ignore[import-not-found,unused-ignore]
    except ImportError:  # before Python 3.14
        from backports import zstd  # what rosbags uses

    with TemporaryDirectory() as folder:
        unpacked = Path(folder, path.stem)
        with path.open("rb") as packed, zstd.open(packed, "rb") as source, unpacked.open("wb") as target:
            while part := source.read(_PART_BYTES):
                if target.tell() + len(part) > MOST_UNPACKED_BYTES:
                    fault = f"becomes more than {MOST_UNPACKED_BYTES} bytes: decompress it with `zstd -d`"
                    raise MapError(fault, source=str(path))
                target.write(part)
        yield unpacked
