"""How events and inputs are stored: compressed with a dictionary of the text that nearly all of them contain.

A packed value begins with the number of its dictionary, so that more dictionaries can be added.
"""

import zlib
from collections.abc import Iterable, Iterator
from importlib.resources import files
from typing import Any

# rows that hold more bytes would not fit beside others on a page of 4096 (SQLite moves them to pages of their own)
PIECE = 900
_LEVEL = 6
_WINDOW = -13  # bits: 8 kB; negative for no header and no checksum
_MEMORY = 6  # of 9: a packer is copied for each value, and few are long

# what is stored was packed with these very bytes: what would do better is a dictionary with another number
_DICTIONARY_1 = (files("marsupial_service.store") / "dictionary_1.txt").read_bytes()
_NUMBER = b"\x01"
_PACKER = zlib.compressobj(_LEVEL, zlib.DEFLATED, _WINDOW, _MEMORY, zlib.Z_DEFAULT_STRATEGY, _DICTIONARY_1)


def pack(data: bytes) -> bytes:
    """Return `data` as it is stored."""
    # a copy has the dictionary loaded, which takes longer than to pack most values
    packer = _PACKER.copy()
    return _NUMBER + packer.compress(data) + packer.flush()


def unpack(data: bytes) -> bytes:
    """Return the data of a packed value."""
    return zlib.decompressobj(_WINDOW, _DICTIONARY_1).decompress(memoryview(data)[1:])


def split(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the parts in which `data` is stored, with their numbers from 0."""
    for part, start in enumerate(range(0, len(data), PIECE)):
        yield part, data[start : start + PIECE]


def joined(rows: Iterable[Any]) -> Iterator[tuple[Any, bytes]]:
    """Yield the first row of each value that is stored in parts, and the value; `rows` have `part` and `data`."""
    first: Any = None
    parts: list[bytes] = []
    for row in rows:
        if row["part"] == 0:
            if parts:
                yield first, unpack(b"".join(parts))
            first, parts = row, []
        parts.append(row["data"])
    if parts:
        yield first, unpack(b"".join(parts))
