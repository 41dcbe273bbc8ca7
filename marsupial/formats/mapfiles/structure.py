"""Refuse images of too many parts before Pillow reads them.

Pillow reads the header of a PGM byte by byte, each comment in the numbers of a plain one with a copy of all that
follows, and the chunks of a PNG one by one. So a few megabytes of comments or empty chunks around ten pixels take many
seconds. No program writes such files.
"""

import re
from pathlib import Path
from typing import BinaryIO

MOST_HEADER_BYTES = 8192  # of a PGM: its size and largest grey, with comments between them
MOST_COMMENTS = 1000  # of a PGM whose greys are written as text

# most chunks of a PNG: so many, and one more for each so many bytes. Most programs write chunks of 8 kB or more
MOST_CHUNKS, CHUNK_BYTES = 1000, 1000

_PNG = b"\x89PNG\r\n\x1a\n"
_COMMENT = re.compile(rb"#[^\r\n]*(?:[\r\n]|\Z)")
_PLAIN = (b"P1", b"P2", b"P3")
_BITMAPS = (b"P1", b"P4")  # which have no largest grey


def structure_fault(file: Path | BinaryIO) -> str | None:
    """Return why an image in a file has too many parts to be read, or None; also None for what is no image."""
    if isinstance(file, Path):
        with file.open("rb") as opened:
            return structure_fault(opened)
    file.seek(0)
    start = file.read(MOST_HEADER_BYTES)
    if start.startswith(_PNG):
        return _png_fault(file)
    return _pgm_fault(file, start) if start.startswith(b"P") else None


def _pgm_fault(file: BinaryIO, start: bytes) -> str | None:
    words = _COMMENT.sub(b" ", start).split(None, 4)
    if len(start) == MOST_HEADER_BYTES and len(words) < (3 if start[:2] in _BITMAPS else 4):
        return f"has a header of more than {MOST_HEADER_BYTES} bytes; remove its comments"
    if start[:2] in _PLAIN and start.count(b"#") + file.read().count(b"#") > MOST_COMMENTS:
        return f"has more than {MOST_COMMENTS} comments; remove them"
    return None


def _png_fault(file: BinaryIO) -> str | None:
    size_bytes = file.seek(0, 2)
    most = MOST_CHUNKS + size_bytes // CHUNK_BYTES
    at = len(_PNG)
    for _ in range(most):
        file.seek(at)
        at += 12 + int.from_bytes(file.read(4), "big")  # length, type and check sum beside the data
        if at >= size_bytes:
            return None
    return f"has more than {most} chunks; save it again"
