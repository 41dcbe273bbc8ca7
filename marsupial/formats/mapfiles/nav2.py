"""Maps of ROS, a `map.yaml` and an image: read as nav2's map server does, and written as its map saver does.

::

    grey (0..255) ──mode, thresholds──► occupancy (-1, 0..100) ──► obstacle (100), unknown (-1), floor (else)

The rules are those of `map_io.cpp` in nav2's map server, in its single precision. A grey g has p = 1 - g/255 (g/255
with `negate`). Mode `trinary` gives 100 for p >= `occupied_thresh`, 0 for p <= `free_thresh`, else -1; `scale` spreads
1..99 between the two; `raw` takes the byte itself. The image's bottom row is row 0 of the map. The second step is what
nav2's static layer does by default (`trinary_costmap` with `lethal_cost_threshold` 100).

A map with wrong thresholds is still a valid map, on which exploration ends too early or never. So reading also returns
warnings about greys whose meaning is doubtful.

Values of the yaml are read as the map server reads them, so ``5e-2``, a text in YAML 1.1, is a number here too. The
file comes from outside: its size is limited, and aliases and tags, which no map file needs, are refused. All wrong
fields are reported at once. Like the map server, we ignore unknown fields; but if one looks like a field that is
absent, it is probably a typo, and a warning names it.

Maps are written in mode trinary with the saver's greys and thresholds, which every release of nav2 reads back. The
format has no terrain, so all ground is free.
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from marsupial.arrays import Ints
from marsupial.errors import MapError, Problem
from marsupial.formats.fields import Fields, shown
from marsupial.formats.files import at_home, file_fault, nearby, read_bytes, utf8
from marsupial.formats.mapfiles.cropping import placed_in, words
from marsupial.formats.mapfiles.images import SUFFIXES, GreyImage, Known, check_size, read_grey
from marsupial.formats.mapfiles.occupancy import UNKNOWN_OCCUPANCY, Occupancy, OccupancyArray
from marsupial.formats.yamlvalues import PlainLoader, YamlFault, parse_yaml, with_lines
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, CellArray, Grid, LegendEntry, MapReading, Mask
from marsupial.model.bounds import BOUNDS
from marsupial.wording import counted, suggestion

MAX_YAML_BYTES = 64 * 1024

_THRESHOLDS = ("free_thresh", "occupied_thresh")
_NUMBERS = ("resolution", "origin", *_THRESHOLDS)
_FIELDS = ("image", "mode", "negate", *_NUMBERS)

_TRUTHS = {"y": 1, "n": 0}  # texts that the map server reads as true and false, but PyYAML doesn't


class Mode(StrEnum):
    """How greys become occupancy."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True, kw_only=True)
class Nav2Header:
    """The content of a map's yaml file; thresholds are occupancies from 0 to 1, `warnings` name probable typos."""

    image: Path
    resolution_m: float
    origin_m: tuple[float, float, float]
    negate: bool
    free_thresh: float
    occupied_thresh: float
    mode: Mode
    warnings: tuple[str, ...] = ()


def read_header(path: Path) -> Nav2Header:
    """Read a map's yaml file, and check that its image exists. Raise `MapError` with every wrong field."""
    return _header(utf8(read_bytes(path, MapError, MAX_YAML_BYTES)), path.parent, str(path))


def header_of(data: bytes) -> Nav2Header:
    """Return the header in the bytes of a yaml file, without checking its image."""
    if len(data) > MAX_YAML_BYTES:
        raise MapError(f"has {len(data)} bytes, more than the limit of {MAX_YAML_BYTES}")
    return _header(utf8(data), None, "")


def _header(text: bytes, folder: Path | None, source: str) -> Nav2Header:
    """Read the fields in `text`, and check that the image exists if a folder is given."""
    fields = Fields(_load(text, source), "", [])
    origin = _origin(fields)
    free, occupied = (_threshold(fields, key) for key in _THRESHOLDS)
    if not fields.problems and free > occupied:
        fields.wrong("free_thresh", f"must not be above occupied_thresh ({occupied:g}), got {free:g}")
    typos = [Problem(key, f"unknown field{meant}") for key, meant in _typos(fields.data)]
    header = Nav2Header(
        image=(folder or Path()) / fields.text("image"),
        resolution_m=fields.number("resolution", None, BOUNDS["resolution_m"]),
        origin_m=(origin[0], origin[1], origin[2]),
        negate=bool(fields.integer("negate")),
        free_thresh=free,
        occupied_thresh=occupied,
        mode=Mode(fields.choice("mode", list(Mode), Mode.TRINARY) or Mode.TRINARY),
        warnings=tuple(f"{typo}; it is ignored" for typo in with_lines(typos, text)),
    )
    if fields.problems:  # a typo may be why a field is missing
        fields.problems += typos
    written = fields.data.get("image")
    if folder is not None and written and isinstance(written, str):
        _check_image(written, folder, fields)
    if fields.problems:
        raise MapError(with_lines(fields.problems, text), source=source)
    return header


def _origin(fields: Fields) -> tuple[float, ...]:
    before = len(fields.problems)
    origin = fields.numbers("origin", 3)
    for i, problem in enumerate(fields.problems[before:], before):
        if problem.path == "origin[2]" and isinstance(yaw := fields.data["origin"][2], float) and math.isnan(yaw):
            advice = f"{problem.message}: write 0, as the map saver got an orientation of all zeros"
            fields.problems[i] = replace(problem, message=advice)
    return origin or (0.0, 0.0, 0.0)


def _threshold(fields: Fields, key: str) -> float:
    """Read a share; explain how to write it if it is in percent, which the map server refuses too."""
    value = fields.data.get(key)
    if isinstance(value, str) and value.endswith("%"):
        fields.wrong(key, f"must be a share from 0 to 1 without a percent sign, as 0.65, got {shown(value)}")
        return 0.0
    return fields.number(key, None, BOUNDS["share"])


def _typos(data: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield each unknown field that looks like an absent one, with a suggestion."""
    absent = [key for key in _FIELDS if key not in data]
    for key in data:
        if meant := "" if key in _FIELDS else suggestion(str(key), absent):
            yield str(key), meant


def _load(data: bytes, source: str) -> Mapping[str, Any]:
    try:
        fields = parse_yaml(data, PlainLoader, aliases=False)
    except YamlFault as fault:
        raise MapError(f"is not valid YAML: {fault}", source=source) from fault
    if fields is None:
        raise MapError("is empty", source=source)
    if not isinstance(fields, dict):
        raise MapError("must hold `key: value` lines (image, resolution, ...)", source=source)
    return {key: _as_map_server(str(key), value) for key, value in fields.items()}


def _as_map_server(key: str, value: Any) -> Any:
    """Return a value as the map server reads it: numbers may be written as texts, a mode in capitals."""
    if isinstance(value, list):
        return [_as_map_server(key, item) for item in value]
    if key == "negate" and isinstance(value, bool):
        return int(value)
    if key == "negate" and isinstance(value, str):
        is_short = len(value) < 10  # `int` refuses thousands of digits
        return _TRUTHS.get(value.lower(), int(value) if is_short and value.isascii() and value.isdigit() else value)
    if key == "mode" and isinstance(value, str):
        return value.lower()
    if key in _NUMBERS and isinstance(value, str):
        with suppress(ValueError):
            return float(value)
    return value


def _check_image(written: str, folder: Path, fields: Fields) -> None:
    image = folder / written
    if (fault := file_fault(image)) is None:
        return
    text = f"{fault}: {image}"
    if found := nearby(folder, written) or _with_other_suffix(folder, written):
        kind = "an absolute path; " if Path(written).is_absolute() else ""
        text += f" ({kind}{found} stands beside the yaml: write `image: {found}`)"
    elif file_fault(home := at_home(written)) is None:
        text += f" (the map server takes `~` for the name of a folder: write `image: {home}`)"
    fields.wrong("image", text)


def _with_other_suffix(folder: Path, written: str) -> str | None:
    """Return the image of the same name that was saved in another format, if it is beside the yaml."""
    stem = written.replace("\\", "/").rpartition("/")[2].rpartition(".")[0]
    return next((found for suffix in SUFFIXES if stem and (found := nearby(folder, stem + suffix))), None)


SAVED_FREE, SAVED_OCCUPIED, SAVED_UNKNOWN = 254, 0, 205  # the greys that map savers write

SAVED_HEADER = {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}

# Greys that a conversion may have made of `SAVED_UNKNOWN`; blurred edges have them too, so they must be frequent.
NEARLY_SAVED_UNKNOWN = range(200, 211)

POPULATED_SHARE = 0.005  # least share of the image of a grey that counts as an area, not as the blur along an edge
DISTINCT_GREYS = 20  # least difference of frequent greys that probably mean different things

_BECAME = {FLOOR: "free", OBSTACLE: "obstacle", UNKNOWN: "unknown"}


def read_nav2(path: Path | str) -> MapReading:
    """Read a nav2 map; return it and how its greys were interpreted."""
    header = read_header(Path(path))
    image = read_grey(header.image, source=str(path), known=known_in(header))
    check_size(image, source=str(path))
    return understand_image(header, image)


def known_in(header: Nav2Header) -> Known:
    """Return the function that finds the known cells of an image with this header."""
    table = occupancy_table(header) >= 0

    def known(grey: CellArray, opaque: Mask | None) -> Mask:
        found = table[grey]
        return found if opaque is None or header.mode is Mode.RAW else found & opaque

    return known


def read_occupancy(path: Path | str) -> Occupancy:
    """Read a nav2 map as the occupancies that nav2's map server publishes; transparent pixels are unknown."""
    header = read_header(Path(path))
    image = read_grey(header.image, source=str(path))
    values = occupancy_table(header)[image.grey]
    if (transparent := _transparent(header, image)) is not None:
        values[transparent] = UNKNOWN_OCCUPANCY
    upright = np.ascontiguousarray(np.flipud(values))
    return Occupancy(values=upright, resolution_m=header.resolution_m, origin_m=header.origin_m)


def understand_image(header: Nav2Header, image: GreyImage) -> MapReading:
    """Return the map of an image with a header, and how its greys were interpreted."""
    table = occupancy_table(header)
    codes = np.select([table < 0, table == 100], [UNKNOWN, OBSTACLE], FLOOR).astype(np.uint8)
    cells = codes[image.grey]
    if (transparent := _transparent(header, image)) is not None:
        cells[transparent] = UNKNOWN
    counts = np.zeros(256, dtype=np.int64)
    for y, row in enumerate(image.grey):  # row by row: counting takes eight bytes a pixel
        counts += np.bincount(row if transparent is None else row[~transparent[y]], minlength=256)
    hidden = image.grey.size - int(counts.sum())
    between = int(counts[(table > 0) & (table < 100)].sum())
    warnings = (
        *header.warnings,
        *_image_warnings(image, hidden),
        *_saved_unknown_warnings(header, counts, codes),
        *_mixed_warnings(header, counts, codes),
        *([f"{counted(between, 'cell')} with an occupancy between 1 and 99 became free"] if between else []),
        *_alpha_warnings(header, image, counts, table),
    )
    upright = np.ascontiguousarray(np.flipud(cells))
    grid = Grid(cells=upright, resolution_m=header.resolution_m, origin_m=header.origin_m)
    form = f"nav2 map, {header.mode}{' negated' if header.negate else ''}, image {header.image.name}"
    return MapReading(
        grid=grid if image.frame is None else placed_in(grid, image.frame),
        format=f"{form}{words(image.frame)}",
        legend=_legend(counts, codes, hidden),
        warnings=warnings,
        frame=image.frame,
    )


def nav2_files(grid: Grid, path: Path) -> dict[Path, bytes]:
    """Return the contents of the yaml at `path` and the image beside it, by path."""
    image = path.with_suffix(".pgm")
    grey = np.full(grid.cells.shape, SAVED_FREE, dtype=np.uint8)
    grey[grid.cells == OBSTACLE] = SAVED_OCCUPIED
    grey[grid.cells == UNKNOWN] = SAVED_UNKNOWN
    header = {"image": image.name, "resolution": grid.resolution_m, "origin": list(grid.origin_m), **SAVED_HEADER}
    pixels = f"P5\n{grid.width} {grid.height}\n255\n".encode() + np.flipud(grey).tobytes()
    return {image: pixels, path: yaml.safe_dump(header, sort_keys=False).encode()}


def occupancy_table(header: Nav2Header) -> OccupancyArray:
    """Return the occupancy (-1, or 0 to 100) of each of the 256 greys."""
    greys = np.arange(256)
    if header.mode is Mode.RAW:
        return np.where(greys <= 100, greys, -1).astype(np.int8)
    # Single precision like the map server, so that a grey right on a threshold falls on the same side.
    shade = greys.astype(np.float32) / np.float32(255)
    p = shade if header.negate else np.float32(1) - shade
    free, occupied = np.float32(header.free_thresh), np.float32(header.occupied_thresh)
    table = np.full(256, -1, dtype=np.int8)
    table[p >= occupied] = 100
    table[p <= free] = 0
    if header.mode is Mode.SCALE:
        between = (p > free) & (p < occupied)
        span = np.float32(header.occupied_thresh - header.free_thresh)
        table[between] = np.floor(((p[between] - free) / span * np.float32(100)).astype(np.float64) + 0.5)
    return table


def _transparent(header: Nav2Header, image: GreyImage) -> Mask | None:
    """Return the mask of pixels that are unknown by their alpha; None if the image has no alpha, or in mode raw."""
    return None if image.opaque is None or header.mode is Mode.RAW else ~image.opaque


def _legend(counts: Ints, codes: CellArray, hidden: int) -> tuple[LegendEntry, ...]:
    greys = [LegendEntry(symbol=f"grey {g}", code=int(codes[g]), cells=int(counts[g])) for g in np.flatnonzero(counts)]
    if hidden:
        greys.append(LegendEntry(symbol="transparent", code=UNKNOWN, cells=hidden))
    return tuple(greys)


def _image_warnings(image: GreyImage, hidden: int) -> list[str]:
    found = []
    if image.coloured:
        found.append(
            f"the image is {image.mode}, not grey: {image.coloured} of its pixels are coloured and were turned into "
            "grey by their brightness"
        )
    if image.format == "JPEG":
        found.append("the image is a JPEG: its compression blurs walls into greys between obstacle and free")
    if hidden:
        found.append(f"{hidden} pixels are transparent and became unknown")
    return found


def _saved_unknown_warnings(header: Nav2Header, counts: Ints, codes: CellArray) -> list[str]:
    """Warn of greys near `SAVED_UNKNOWN` that became free or obstacle."""
    found = []
    for code, key in ((FLOOR, "free_thresh"), (OBSTACLE, "occupied_thresh")):
        greys = [g for g in NEARLY_SAVED_UNKNOWN if counts[g] and codes[g] == code]
        cells = int(counts[greys].sum())
        if SAVED_UNKNOWN not in greys and cells < max(1, POPULATED_SHARE * int(counts.sum())):
            continue
        area = cells * header.resolution_m**2
        names = f"grey{'s' if len(greys) > 1 else ''} {', '.join(map(str, greys))}"
        text = (
            f"{names} became {_BECAME[code]} in {counted(cells, 'cell')} "
            f"({area:.4g} m2, {cells / counts.sum():.1%}), yet map savers write grey {SAVED_UNKNOWN} for unknown"
        )
        if code == FLOOR and header.mode is Mode.SCALE:
            text += ": in mode scale only transparent pixels are unknown"
        elif header.mode is not Mode.RAW:
            text += f": check {key} ({getattr(header, key):g})"
        if code == FLOOR and header.mode is Mode.TRINARY and not header.negate:
            text += f"; {_threshold_below(max(greys)):.3f} would leave them unknown"
        found.append(text)
    return found


def _threshold_below(grey: int) -> float:
    """Return the largest `free_thresh` of three digits with which `grey` is not free."""
    occupancy = 1 - grey / 255
    rounded = int(occupancy * 1000) / 1000
    return rounded if rounded < occupancy - 1e-6 else rounded - 0.001


def _mixed_warnings(header: Nav2Header, counts: Ints, codes: CellArray) -> list[str]:
    """Warn of frequent greys that are far apart but became the same: one of them probably means something else."""
    if header.mode is not Mode.TRINARY:
        return []
    total = max(int(counts.sum()), 1)
    found = []
    for code, word in _BECAME.items():
        frequent = np.flatnonzero((codes == code) & (counts >= POPULATED_SHARE * total)).tolist()
        greys = [g for g in frequent if g not in NEARLY_SAVED_UNKNOWN or code == UNKNOWN]
        if greys and greys[-1] - greys[0] >= DISTINCT_GREYS:
            shares = " and ".join(f"{g} ({counts[g] / total:.1%})" for g in (greys[0], greys[-1]))
            found.append(
                f"greys {shares} both became {word}: if the picture means different things by them, "
                f"free_thresh ({header.free_thresh:g}) and occupied_thresh ({header.occupied_thresh:g}) do not fit it"
            )
    return found


def _alpha_warnings(header: Nav2Header, image: GreyImage, counts: Ints, table: OccupancyArray) -> list[str]:
    """Warn if releases of nav2 up to Jazzy read an image with alpha differently."""
    # In mode trinary they take the mean of red, green, blue and alpha, so opaque pixels are brighter to them.
    if image.opaque is None or header.mode is not Mode.TRINARY:
        return []
    shade = (3 * np.arange(256) + 255) / (4 * 255)
    p = shade if header.negate else 1 - shade
    until_jazzy = np.select([p > header.occupied_thresh, p < header.free_thresh], [100, 0], -1)
    cells = int(counts[until_jazzy != table].sum())
    text = (
        f"the image has an alpha channel: nav2 up to Jazzy counts it as a fourth colour and reads {cells} opaque "
        "pixels otherwise; without the channel all releases agree"
    )
    return [text] if cells else []
