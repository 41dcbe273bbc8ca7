"""Read images as 8-bit grey, one byte per pixel.

Colours become grey as in nav2's map server, which uses ImageMagick: the Rec. 709 luma 0.212656 R + 0.715158 G +
0.072186 B, rounded. Releases of nav2 up to Jazzy took the mean of the channels. The two differ only in coloured pixels,
which are counted here, and in images with alpha (see `nav2`). 16-bit greys are divided by 257 and rounded.

A small compressed file can hold an image that fills the memory, so the size in the header is checked before a pixel is
decoded. Of a large image only the known part is kept (`cropping`): it is converted in bands of rows, and the rest never
takes more than Pillow's own memory. A map that stays too large for its file is refused (`check_size`).
"""

import contextlib
import io
import struct
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
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
from marsupial.formats.mapfiles.cropping import WHOLE_CELLS, known_window
from marsupial.formats.mapfiles.structure import structure_fault
from marsupial.model.grid import CellArray, CroppedFrame, Mask

MAX_CELLS = 100_000_000  # most cells of a map

# Most cells per byte of a compressed map; drawn and scanned maps have a few dozen, plans of buildings up to 180. The
# smallest files may have more (`WHOLE_CELLS`). Files of less than 100 kB have a limit besides: a mission on so many
# cells takes about 500 MB more than one on a small map.
CELLS_PER_BYTE = 160
SMALL_BYTES, SMALL_CELLS = 100_000, 4_250_000

# Most bytes that an image in a small file may take while it is decoded: 8192 x 8192 greys, 4096 x 4096 colours.
DECODED_BYTES = 1 << 26
_PIXEL_BYTES = {"1": 1, "L": 1, "P": 1, "I;16": 2, "I;16B": 2, "I;16L": 2}  # of Pillow; all other formats take 4

BAND = 1 << 20  # pixels that are converted at a time while the known part is searched
FILE_BYTES = 4 * MAX_CELLS  # most bytes of a file: no image needs more

# The decoders used; ``PPM`` is Pillow's name for PGM, PPM and PBM. The content decides, not the suffix.
FORMATS = ("PNG", "PPM", "BMP", "JPEG")

SUFFIXES = (".pgm", ".png", ".bmp", ".jpg", ".jpeg", ".ppm")

_HEADERS = (PngImageFile, PpmImageFile, BmpImageFile, JpegImageFile)

_SMALLER = "crop the map or give it larger cells"

# Returns the mask of known cells, of greys and the opaque pixels (None for all).
Known = Callable[[CellArray, Mask | None], Mask]

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
    size_bytes: int  # of the file
    frame: CroppedFrame | None = None  # the whole image, if only its known part was kept


def read_grey(
    path: Path, *, field: str = "image", source: str = "", max_cells: int = MAX_CELLS, known: Known | None = None
) -> GreyImage:
    """Read an image of at most `max_cells` pixels as grey; a `MapError` names the `field` of the file `source`.

    Of a large image only the part that is `known` is kept, if that is given.
    """
    found = file_fault(path, FILE_BYTES) or _decode(path, max_cells, known)
    if isinstance(found, str):
        raise MapError([Problem(field, f"{found}: {path}")], source=source)
    return found


def grey_of(data: bytes, *, field: str = "image", max_cells: int = MAX_CELLS, known: Known | None = None) -> GreyImage:
    """Return the image in `data`; see `read_grey`. Raise `MapError` if it is not an image, is broken or too big."""
    found = _decode(io.BytesIO(data), max_cells, known)
    if isinstance(found, str):
        raise MapError([Problem(field, found)])
    return found


def check_size(image: GreyImage, *, field: str = "image", source: str = "") -> None:
    """Raise a `MapError` if an image that was read as a map has more cells than its file may have."""
    height, width = image.grey.shape
    if fault := size_fault(width, height, image.size_bytes):
        raise MapError([Problem(field, fault)], source=source)


def size_of(data: bytes, *, field: str = "image") -> tuple[int, int]:
    """Return width and height from the header of a PNG or PGM image; raise a `MapError` for any other file."""
    fault = structure_fault(io.BytesIO(data))
    header = None if fault else _header(io.BytesIO(data), (PngImageFile, PpmImageFile))
    if fault is not None:
        raise MapError([Problem(field, fault)])
    if header is None:
        raise MapError([Problem(field, "is not a PNG or PGM image")])
    return header[:2]


def _header(file: Path | io.BytesIO, kinds: Sequence[type[ImageFile]]) -> tuple[int, int, str] | None:
    """Return width, height and pixel format of an image of one of these kinds by its header; None for other files."""
    for kind in kinds:
        if not isinstance(file, Path):
            file.seek(0)
        with contextlib.suppress(*_BROKEN), _first_of_animation(), kind(file) as image:
            return image.width, image.height, image.mode
    return None


@contextlib.contextmanager
def _first_of_animation() -> Iterator[None]:
    """Silence Pillow's warning of a broken animation: its first picture is the map."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Invalid APNG")
        yield


def size_fault(
    width: int, height: int, size_bytes: int, advice: str = ", or save it uncompressed (PGM) if it really is that large"
) -> str | None:
    """Return the fault of the size of a map, or its known part, in a file of `size_bytes`, which may be compressed."""
    # A blank map of any size fits in a few compressed bytes, but a mission on it takes gigabytes.
    most = max(WHOLE_CELLS, CELLS_PER_BYTE * size_bytes)
    most = most if size_bytes >= SMALL_BYTES else min(most, SMALL_CELLS)
    if width * height <= most:
        return None
    return (
        f"{width} x {height} cells are more than the limit of {most} for a compressed file of {size_bytes} "
        f"bytes: {_SMALLER}{advice}"
    )


def _frame_fault(width: int, height: int, mode: str, size_bytes: int, max_cells: int) -> str | None:
    """Return why an image with this header is not decoded, or None."""
    if width * height > max_cells:
        return f"{width} x {height} cells are more than the limit of {max_cells}: {_SMALLER}"
    most = max(DECODED_BYTES // _PIXEL_BYTES.get(mode, 4), CELLS_PER_BYTE * size_bytes)
    if width * height <= most:
        return None
    return f"{width} x {height} pixels are more than the limit of {most} for a file of {size_bytes} bytes: {_SMALLER}"


def _decode(file: Path | io.BytesIO, max_cells: int, known: Known | None) -> GreyImage | str:
    """Return the image, or the reason why it can't be decoded."""
    try:
        return _load(file, max_cells, known)
    except UnidentifiedImageError:
        return "is not a PNG, PGM, BMP or JPEG image"
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        return f"has more cells than the limit of {max_cells}: {_SMALLER}"
    except _BROKEN as error:
        return f"can't be decoded ({error})"


def _load(file: Path | io.BytesIO, max_cells: int, known: Known | None) -> GreyImage | str:
    if fault := structure_fault(file):
        return fault
    header = _header(file, _HEADERS)
    size_bytes = file.stat().st_size if isinstance(file, Path) else file.getbuffer().nbytes
    # Before Pillow opens it: Pillow's own check also warns of large maps that are within our limits.
    if header is not None and (fault := _frame_fault(*header, size_bytes, max_cells)):
        return fault
    with _first_of_animation(), Image.open(file, formats=FORMATS) as image:
        image.load()
        if image.mode == "P" and image.palette is None:
            raise ValueError("its palette is missing")
        part: Image.Image = image
        frame = None
        if known is not None and image.width * image.height > WHOLE_CELLS:
            part, frame = _known_part(image, known)
        grey, coloured = _grey(part)
        return GreyImage(
            grey=grey,
            opaque=_opaque(part),
            format=str(image.format),
            mode=image.mode,
            coloured=coloured,
            size_bytes=size_bytes,
            frame=frame,
        )


def _known_part(image: Image.Image, known: Known) -> tuple[Image.Image, CroppedFrame | None]:
    """Return the known part of an image and its place; the whole image if there is nothing to cut off."""
    width, height = image.size
    rows = max(1, BAND // width)

    def bands() -> Iterator[tuple[int, Mask]]:
        for top in range(0, height, rows):
            band = image.crop((0, top, width, min(height, top + rows)))
            yield top, known(_grey(band)[0], _opaque(band))

    window = known_window(bands(), (height, width))  # its rows count from the top
    if window is None:
        return image, None
    frame = CroppedFrame(width=width, height=height, left=window.left, bottom=height - window.top)
    return image.crop((window.left, window.bottom, window.right, window.top)), frame


def _opaque(image: Image.Image) -> Mask | None:
    if not image.has_transparency_data or image.mode.startswith("I"):
        return None
    return np.asarray(image.convert("RGBA").getchannel("A")) == 255


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
