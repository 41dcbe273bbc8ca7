import io
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngImageFile
from PIL.PpmImagePlugin import PpmImageFile

from marsupial.errors import MapError
from marsupial.formats.mapfiles.images import grey_of, read_grey, size_fault, size_of

SHADES = np.array([[0, 100, 200], [50, 150, 255]], dtype=np.uint8)


def test_grey_comes_back_as_it_is_top_row_first(tmp_path: Path) -> None:
    for name in ("a.pgm", "a.png", "a.bmp"):
        Image.fromarray(SHADES).save(tmp_path / name)
        image = read_grey(tmp_path / name)
        assert (image.grey.tolist(), image.opaque, image.coloured) == (SHADES.tolist(), None, 0)


def test_alpha_or_a_transparent_colour_gives_the_opaque_pixels(tmp_path: Path) -> None:
    alpha = np.array([[255, 254, 0], [255, 1, 255]], dtype=np.uint8)
    Image.fromarray(np.dstack([SHADES, SHADES, SHADES, alpha])).save(tmp_path / "a.png")
    image = read_grey(tmp_path / "a.png")
    assert image.grey.tolist() == SHADES.tolist()
    assert image.opaque.tolist() == [[True, False, False], [True, False, True]]
    Image.fromarray(SHADES).save(tmp_path / "a.png", transparency=100)
    assert read_grey(tmp_path / "a.png").opaque.tolist() == [[True, False, True], [True, True, True]]


def test_16_bit_greys_are_rounded_to_8(tmp_path: Path) -> None:
    Image.fromarray(np.array([[0, 128, 129, 65535]], dtype=np.uint16)).save(tmp_path / "a.png")
    (tmp_path / "a.pgm").write_bytes(b"P5 4 1 65535\n" + np.array([0, 128, 129, 65535], dtype=">u2").tobytes())
    assert read_grey(tmp_path / "a.png").grey.tolist() == [[0, 0, 1, 255]]
    assert read_grey(tmp_path / "a.pgm").grey.tolist() == [[0, 0, 1, 255]]


def test_the_field_and_the_file_that_named_the_image_stand_in_the_error(tmp_path: Path) -> None:
    with pytest.raises(MapError) as caught:
        read_grey(tmp_path / "gone.png", field="terrain.mask", source="scenario.yaml")
    assert str(caught.value) == f"scenario.yaml: terrain.mask: no such file: {tmp_path / 'gone.png'}"


def test_more_pixels_than_allowed_are_refused(tmp_path: Path) -> None:
    Image.fromarray(SHADES).save(tmp_path / "a.png")
    assert read_grey(tmp_path / "a.png", max_cells=6).grey.size == 6
    with pytest.raises(MapError, match="3 x 2 cells are more than the limit of 5"):
        read_grey(tmp_path / "a.png", max_cells=5)


@pytest.mark.parametrize(
    ("width", "height", "message"),
    [
        (9999, 9999, "9999 x 9999 pixels are more than the limit of 67108864 for a file of 67 bytes: crop"),
        (30_000, 30_000, "30000 x 30000 cells are more than the limit of 100000000: crop the map"),
    ],
)
def test_a_small_file_of_a_huge_map_is_refused_by_its_header(
    tmp_path: Path, width: int, height: int, message: str
) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(png_that_says(width, height))
    with pytest.raises(MapError, match=f"{message}.*bomb.png"):
        read_grey(path)


@pytest.mark.parametrize(
    ("cells", "size_bytes", "fault"),
    [
        (2_125_000, 50, None),
        (2_125_001, 13_281, "limit of 2125000 for"),
        (2_240_000, 14_000, None),
        (4_250_000, 99_999, None),
        (4_250_001, 99_999, "limit of 4250000 for"),
        (16_000_000, 100_000, None),
        (16_000_001, 100_000, "limit of 16000000 for"),
    ],
)
def test_a_large_map_needs_a_file_that_is_not_too_small(cells: int, size_bytes: int, fault: str | None) -> None:
    found = size_fault(cells, 1, size_bytes)
    assert found == fault if fault is None else fault in str(found)


@pytest.mark.parametrize(("mode", "side"), [("L", 8193), ("RGB", 4097), ("RGBA", 4097), ("LA", 4097), ("I;16", 5793)])
def test_the_memory_to_decode_an_image_is_bounded_by_its_header(mode: str, side: int) -> None:
    kinds = {"L": (8, 0), "RGB": (16, 2), "RGBA": (16, 6), "LA": (8, 4), "I;16": (16, 0)}
    bits, kind = kinds[mode]
    with pytest.raises(MapError, match=f"{side} x {side} pixels are more than the limit of"):
        grey_of(png_that_says(side, side, kind, bits))


@pytest.mark.parametrize("name", ["a.pgm", "a.png", "a.bmp", "a.jpg"])
def test_no_cut_or_changed_file_raises_anything_but_a_map_error(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    Image.fromarray(SHADES).save(path)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    broken = [whole[:size] for size in range(0, len(whole), 3)]
    for _ in range(100):
        changed = bytearray(whole)
        for place in rng.integers(0, len(whole), 3):
            changed[place] = rng.integers(0, 256)
        broken.append(bytes(changed))
    refused = 0
    for data in broken:
        path.write_bytes(data)
        try:
            read_grey(path, max_cells=10_000)
        except MapError:
            refused += 1
    assert refused > 10


def png_that_says(width: int, height: int, kind: int = 0, bits: int = 8) -> bytes:
    """Return a PNG whose header names a size its data doesn't have."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0\0")) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "size"),
    [(png_that_says(3, 2), (3, 2)), (png_that_says(10**6, 10**6), (10**6, 10**6)), (b"P5 7 8 255\n", (7, 8))],
)
def test_the_size_is_read_from_the_header_alone(data: bytes, size: tuple[int, int]) -> None:
    assert size_of(data) == size


@pytest.mark.filterwarnings("error")
def test_a_broken_animation_is_no_warning() -> None:
    png, said = png_that_says(1, 1), b"acTL" + struct.pack(">II", 0, 1)
    broken = png[:33] + struct.pack(">I", 8) + said + struct.pack(">I", zlib.crc32(said)) + png[33:]
    assert size_of(broken) == (1, 1)
    assert grey_of(broken).grey.shape == (1, 1)


def test_a_missing_palette_is_named() -> None:
    with pytest.raises(MapError, match="its palette is missing"):
        grey_of(png_that_says(1, 1, kind=3))


@pytest.mark.parametrize("data", [b"", b"GIF89a", b"\x89PNG\r\n\x1a\n", b"P5 x"])
def test_a_file_without_an_image_header_has_no_size(data: bytes) -> None:
    with pytest.raises(MapError, match="is not a PNG or PGM image"):
        size_of(data)


def test_an_image_is_read_from_bytes_as_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "map.pgm"
    path.write_bytes(b"P5 2 1 255\n\x00\xfe")
    assert grey_of(path.read_bytes()).grey.tolist() == read_grey(path).grey.tolist() == [[0, 254]]
    with pytest.raises(MapError, match=r"mask: .*more than the limit of 1"):
        grey_of(path.read_bytes(), field="mask", max_cells=1)


def pieces_of_png(kind: bytes, number: int) -> bytes:
    """Return a small PNG with so many more chunks before its pixels."""
    buffer = io.BytesIO()
    Image.new("L", (10, 10), 255).save(buffer, "PNG")
    png, chunk = buffer.getvalue(), struct.pack(">I", 0) + kind + struct.pack(">I", zlib.crc32(kind))
    return png[:33] + chunk * number + png[33:]


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (b"P5\n#" + b"c" * 20_000 + b"\n10 10\n255\n" + b"\xff" * 100, "has a header of more than 8192 bytes"),
        (b"P5\n" + b"#\n" * 10_000 + b"10 10\n255\n" + b"\xff" * 100, "has a header of more than 8192 bytes"),
        (b"P4 10" + b" " * 10_000 + b"10\n" + b"\xff" * 20, "has a header of more than 8192 bytes"),
        (b"P2\n10 10\n255\n" + b"#\n" * 10_000 + b"1 " * 100, "has more than 1000 comments"),
        (pieces_of_png(b"tEXt", 10_000), "has more than 1120 chunks"),
        (pieces_of_png(b"IDAT", 10_000), "has more than 1120 chunks"),
    ],
    ids=["comment", "comments", "spaces", "comments among greys", "texts", "pieces of pixels"],
)
def test_an_image_of_too_many_parts_is_refused_before_it_is_read(
    data: bytes, fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(*_: object) -> None:
        raise AssertionError("Pillow reads it")

    monkeypatch.setattr(PngImageFile, "_open", read)
    monkeypatch.setattr(PpmImageFile, "_open", read)
    (tmp_path / "map").write_bytes(data)
    for attempt in (lambda: size_of(data), lambda: grey_of(data), lambda: read_grey(tmp_path / "map")):
        with pytest.raises(MapError, match=fault):
            attempt()


@pytest.mark.parametrize(
    "data",
    [
        b"P5 #by a program\n10 10\n#greys\n255\n" + b" " * 100,
        b"P4 10 10\n" + b"#" * 20,
        b"P2 10 10 255\n" + b"255 # a corner\n" * 100,
        pieces_of_png(b"tEXt", 1000),
    ],
    ids=["binary", "bitmap", "plain", "png"],
)
def test_comments_and_greys_that_look_like_them_are_no_fault(data: bytes) -> None:
    assert (size_of(data), grey_of(data).grey.shape) == ((10, 10), (10, 10))


def test_a_large_header_of_a_large_image_is_within_its_bound() -> None:
    data = b"P5\n#" + b"c" * 8000 + b"\n100 100\n255\n" + b"#" * 10_000
    assert size_of(data) == (100, 100)
