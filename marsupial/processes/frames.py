"""Frames: how bytes travel between the processes of a job.

A frame is a one-byte tag, the length in four bytes, and that many bytes. Its size is bounded, so that a job gone wild
can't fill the memory of those who listen.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator

START = b"S"  # to the supervisor: the job; from it: its process id
MESSAGE = b"M"  # a pickled value
DONE = b"D"  # from the worker: nothing more comes
FAILED = b"F"  # from the worker: pickled (ending, detail)
ENDED = b"E"  # from the supervisor: the pickled `Ended`

MAX_BYTES = 16 << 20
_HEADER = struct.Struct("!cI")


class FrameTooBig(ValueError):
    """A frame above the bound, or bytes that are no frame at all."""


def pack(tag: bytes, payload: bytes = b"") -> bytes:
    """Return the frame as bytes."""
    if len(payload) > MAX_BYTES:
        raise FrameTooBig(f"a message has {len(payload)} bytes, at most {MAX_BYTES} are allowed")
    return _HEADER.pack(tag, len(payload)) + payload


class FrameBuffer:
    """Takes bytes as they come and gives back whole frames."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def __len__(self) -> int:
        return len(self._bytes)

    def feed(self, chunk: bytes) -> None:
        """Add bytes."""
        self._bytes += chunk

    def frames(self) -> Iterator[tuple[bytes, bytes]]:
        """Yield and drop every whole (tag, payload) there is."""
        while len(self._bytes) >= _HEADER.size:
            tag, length = _HEADER.unpack_from(self._bytes)
            if length > MAX_BYTES:
                raise FrameTooBig(f"a message of {length} bytes was announced, at most {MAX_BYTES} are allowed")
            end = _HEADER.size + length
            if len(self._bytes) < end:
                return
            payload = bytes(self._bytes[_HEADER.size : end])
            del self._bytes[:end]
            yield tag, payload


def write_all(fd: int, data: bytes) -> None:
    """Write all of `data` to a blocking file descriptor."""
    view = memoryview(data)
    while view:
        view = view[os.write(fd, view) :]
