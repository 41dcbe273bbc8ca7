"""Maps of ROS, a `map.yaml` and an image: read as nav2's map server does, and written as its map saver does.

::

    grey (0..255) ──mode, thresholds──► occupancy (-1, 0..100) ──► obstacle (100), unknown (-1), floor (else)

The rules are those of `map_io.cpp` in nav2's map server, in its single precision. A grey g has p = 1 - g/255 (g/255
with `negate`). Mode `trinary` gives 100 for p >= `occupied_thresh`, 0 for p <= `free_thresh`, else -1; `scale` spreads
1..99 between the two; `raw` takes the byte itself. The image's bottom row is row 0 of the map. The second step is what
nav2's static layer does by default (`trinary_costmap` with `lethal_cost_threshold` 100).

A map with wrong thresholds is still a valid map, on which exploration ends too early or never. So reading also returns
warnings about greys whose meaning is doubtful.

Maps are written in mode trinary with the saver's greys and thresholds, which every release of nav2 reads back. The
format has no terrain, so all ground is free.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from marsupial.arrays import Ints
from marsupial.formats.mapfiles.images import GreyImage, read_grey
from marsupial.formats.mapfiles.nav2_header import Mode, Nav2Header, read_header
from marsupial.formats.mapfiles.occupancy import UNKNOWN_OCCUPANCY, Occupancy, OccupancyArray
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, CellArray, Grid, LegendEntry, MapReading, Mask
from marsupial.wording import counted

SAVED_FREE, SAVED_OCCUPIED, SAVED_UNKNOWN = 254, 0, 205  # the greys that map savers write

_SAVED_HEADER = {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}

NEARLY_SAVED_UNKNOWN = range(200, 211)
"""Greys that a conversion may have made of `SAVED_UNKNOWN`; blurred edges have them too, so they must be frequent."""

POPULATED_SHARE = 0.005  # least share of the image of a grey that counts as an area, not as the blur along an edge
DISTINCT_GREYS = 20  # least difference of frequent greys that probably mean different things

_BECAME = {FLOOR: "free", OBSTACLE: "obstacle", UNKNOWN: "unknown"}


def read_nav2(path: Path | str) -> MapReading:
    """Read a nav2 map; return it and how its greys were interpreted."""
    header = read_header(Path(path))
    return understand_image(header, read_grey(header.image, source=str(path)))


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
    return MapReading(
        grid=Grid(cells=upright, resolution_m=header.resolution_m, origin_m=header.origin_m),
        format=f"nav2 map, {header.mode}{' negated' if header.negate else ''}, image {header.image.name}",
        legend=_legend(counts, codes, hidden),
        warnings=warnings,
    )


def nav2_files(grid: Grid, path: Path) -> dict[Path, bytes]:
    """Return the contents of the yaml at `path` and the image beside it, by path."""
    image = path.with_suffix(".pgm")
    grey = np.full(grid.cells.shape, SAVED_FREE, dtype=np.uint8)
    grey[grid.cells == OBSTACLE] = SAVED_OCCUPIED
    grey[grid.cells == UNKNOWN] = SAVED_UNKNOWN
    header = {"image": image.name, "resolution": grid.resolution_m, "origin": list(grid.origin_m), **_SAVED_HEADER}
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
    elif image.mode not in ("1", "L", "I", "I;16"):
        found.append(f"the image is {image.mode}, not grey; none of its pixels is coloured, so nothing is lost")
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
