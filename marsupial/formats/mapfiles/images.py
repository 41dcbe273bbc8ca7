"""Read images as 8-bit grey, one byte per pixel.

Colours become grey as in nav2's map server, which uses ImageMagick: the Rec. 709 luma 0.212656 R + 0.715158 G +
0.072186 B, rounded. Releases of nav2 up to Jazzy took the mean of the channels. The two differ only in coloured pixels,
which are counted here, and in images with alpha (see `nav2`). 16-bit greys are divided by 257 and rounded.

A small compressed file can hold an image that fills the memory, so the size in the header is checked before a pixel is
decoded.
"""

import contextlib
import io
import struct
import warnings
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError
from PIL.BmpImagePlugin import BmpImageFile
from PIL.ImageFile import ImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.PpmImagePlugin import PpmImageFile

from marsupial.errors import MapError, Problem
from marsupial.formats.files import file_fault
from marsupial.model.grid import CellArray, Mask

MAX_CELLS = 100_000_000  # most cells of a map

# Most cells of a map in a compressed file of fewer bytes; a mission on it takes less than 500 MB.
SMALL_BYTES, SMALL_CELLS = 100_000, 2_125_000

CELLS_PER_BYTE = 160  # most cells per byte of a larger file; drawn and scanned maps have a few dozen

# The decoders used; ``PPM`` is Pillow's name for PGM, PPM and PBM. The content decides, not the suffix.
FORMATS = ("PNG", "PPM", "BMP", "JPEG")

SUFFIXES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".ppm")

_HEADERS = (PngImageFile, PpmImageFile, BmpImageFile, JpegImageFile)

_SMALLER = "crop the map or give it larger cells"

_LUMA = np.array([0.212656, 0.715158, 0.072186])
_BROKEN = (OSError, ValueError, SyntaxError, EOFError, IndexError, OverflowError, struct.error, zlib.error)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GreyImage:
    """An image as grey values."""

    grey: CellArray  # uint8 (height, width), the top row first
    opaque: Mask | None  # mask (height, width) of the pixels whose alpha is 255; None if the image has no alpha
    # format, mode: file format and pixel format by Pillow's names (``PNG``, ``RGB``)
    format: str
    mode: str
    coloured: int  # number of pixels whose red, green and blue differ


def read_grey(path: Path, *, field: str = "image", source: str = "", max_cells: int = MAX_CELLS) -> GreyImage:
    """Read an image of at most `max_cells` pixels as grey; a `MapError` names the `field` of the file `source`."""
    found = file_fault(path) or _decode(path, max_cells)
    if isinstance(found, str):
        raise MapError([Problem(field, f"{found}: {path}")], source=source)
    return found


def grey_of(data: bytes, *, field: str = "image", max_cells: int = MAX_CELLS) -> GreyImage:
    """Return the image in `data`; see `read_grey`. Raise `MapError` if it is not an image, is broken or too big."""
    found = _decode(io.BytesIO(data), max_cells)
    if isinstance(found, str):
        raise MapError([Problem(field, found)])
    return found


def size_of(data: bytes, *, field: str = "image") -> tuple[int, int]:
    """Return width and height from the header of a PNG or PGM image; raise a `MapError` for any other file."""
    size = _header_size(io.BytesIO(data), (PngImageFile, PpmImageFile))
    if size is None:
        raise MapError([Problem(field, "is not a PNG or PGM image")])
    return size


def _header_size(file: Path | io.BytesIO, kinds: Sequence[type[ImageFile]]) -> tuple[int, int] | None:
    """Return width and height from the header of an image of one of these kinds; None for any other file."""
    for kind in kinds:
        if not isinstance(file, Path):
            file.seek(0)
        with contextlib.suppress(*_BROKEN), _first_of_animation(), kind(file) as image:
            return image.width, image.height
    return None


@contextlib.contextmanager
def _first_of_animation() -> Iterator[None]:
    """Silence Pillow's warning of a broken animation: its first picture is the map."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Invalid APNG")
        yield


def size_fault(width: int, height: int, size_bytes: int, max_cells: int = MAX_CELLS) -> str | None:
    """Return the fault of a map's size in a file of `size_bytes`, which may be compressed, or None."""
    # A blank map of any size fits in a few compressed bytes, but a mission on it takes gigabytes.
    cells = width * height
    if cells > max_cells:
        return f"{width} x {height} cells are more than the limit of {max_cells}: {_SMALLER}"
    most = SMALL_CELLS if size_bytes < SMALL_BYTES else CELLS_PER_BYTE * size_bytes
    if cells <= most:
        return None
    return (
        f"{width} x {height} cells are more than the limit of {most} for a compressed file of {size_bytes} bytes: "
        f"{_SMALLER}, or save it uncompressed (PGM) if it really is that large"
    )


def _decode(file: Path | io.BytesIO, max_cells: int) -> GreyImage | str:
    """Return the image, or the reason why it can't be decoded."""
    try:
        return _load(file, max_cells)
    except UnidentifiedImageError:
        return "is not a PNG, PGM, BMP or JPEG image"
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        return f"has more cells than the limit of {max_cells}: {_SMALLER}"
    except _BROKEN as error:
        return f"can't be decoded ({error})"


def _load(file: Path | io.BytesIO, max_cells: int) -> GreyImage | str:
    size = _header_size(file, _HEADERS)
    size_bytes = file.stat().st_size if isinstance(file, Path) else file.getbuffer().nbytes
    # Before Pillow opens it: Pillow's own check also warns of large maps that are within our limits.
    if size is not None and (fault := size_fault(*size, size_bytes, max_cells)):
        return fault
    with _first_of_animation(), Image.open(file, formats=FORMATS) as image:
        image.load()
        if image.mode == "P" and image.palette is None:
            raise ValueError("its palette is missing")
        has_alpha = image.has_transparency_data and not image.mode.startswith("I")
        opaque = np.asarray(image.convert("RGBA").getchannel("A")) == 255 if has_alpha else None
        grey, coloured = _grey(image)
        return GreyImage(grey=grey, opaque=opaque, format=str(image.format), mode=image.mode, coloured=coloured)


def _grey(image: Image.Image) -> tuple[CellArray, int]:
    if image.mode.startswith("I"):
        values = np.clip(np.asarray(image), 0, 65535).astype(np.uint32)
        return ((values + 128) // 257).astype(np.uint8), 0  # 65535 = 255 * 257
    if image.mode in ("1", "L"):
        return np.asarray(image.convert("L")), 0
    if image.mode in ("LA", "P", "PA", "RGB", "RGBA", "CMYK"):
        return _from_rgb(np.asarray(image.convert("RGBA"))[..., :3])
    raise ValueError(f"pixel format {image.mode} is not a grey or colour image")


def _from_rgb(rgb: CellArray) -> tuple[CellArray, int]:
    red, green, blue = (rgb[..., i] for i in range(3))
    # The luma of a grey pixel is its grey: compute only coloured ones, which are few.
    coloured = (red != green) | (green != blue)
    grey = red.copy()
    grey[coloured] = np.floor(rgb[coloured] @ _LUMA + 0.5).astype(np.uint8)
    return grey, int(np.count_nonzero(coloured))
