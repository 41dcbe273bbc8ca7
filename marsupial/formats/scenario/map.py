"""The fields ``map`` and ``terrains`` of a scenario file.

::

    file | generator | rows ──► cells ──► mask (an image) ──► keepout, speed (nav2 masks) ──► grid
                                            each paints terrain over known cells without obstacle

The scenario's own terrain classes are added to those that every map has. Rows have one character per cell and the top
row first, as a map is seen.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.formats.fields import Fields, Notes, is_whole, shown
from marsupial.formats.mapfiles.masks import BASE, MULTIPLIER, FilterMasks, KeepoutMask, SpeedMask, read_mask
from marsupial.formats.mapfiles.nav2 import read_occupancy
from marsupial.formats.mapfiles.occupancy import Occupancy
from marsupial.formats.mapfiles.read import has_scale, in_folder, read_map
from marsupial.generators import GENERATORS
from marsupial.model import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Cell, CellArray, Grid, MapReading, Terrain
from marsupial.model.bounds import BOUNDS, Bound
from marsupial.wording import unknown

SYMBOLS = {"#": OBSTACLE, ".": FLOOR, "~": ROUGH, "?": UNKNOWN}  # characters that need no legend
_MOST_ROWS = 100  # most wrong rows to report
_MOST_SYMBOLS = 10  # most wrong characters of a row to report

_NO_SYMBOL = f"must be a text of one character, none of {' '.join(SYMBOLS)}"

SOURCES = ("file", "generator", "rows")

_KEYS = ("mask", "keepout", "speed", "width_m", "height_m", "resolution_m", "seed", "origin_m", "legend")


def read_terrains(top: Fields) -> tuple[Terrain, ...]:
    """Read the list ``terrains``; return the classes that every map has, then those."""
    terrains = list(TERRAINS)
    for fields in top.parts("terrains", required=False):
        name = fields.name("name")
        code = fields.integer("code", free_code(terrains), BOUNDS["terrain_code"])
        blocks_sight = fields.flag("blocks_sight", False)
        fields.finish()
        if name and code:
            add_terrain(terrains, Terrain(code=code, name=name, blocks_sight=blocks_sight), fields)
    return tuple(terrains)


def add_terrain(terrains: list[Terrain], terrain: Terrain, notes: Notes) -> None:
    """Add a terrain class, or note a problem if its name or code is used already."""
    if terrain.name in {other.name for other in terrains}:
        notes.wrong("name", f"{terrain.name!r} is used twice")
    elif terrain.code in {other.code for other in terrains}:
        notes.wrong("code", f"{terrain.code} is used twice")
    elif terrain.code == UNKNOWN:
        notes.wrong("", "is one more terrain than there are codes")
    else:
        terrains.append(terrain)


def free_code(terrains: list[Terrain]) -> int:
    """Return the lowest unused code."""
    used = {terrain.code for terrain in terrains}
    return next((code for code in range(UNKNOWN) if code not in used), UNKNOWN)


class MapField(NamedTuple):
    """The map of a scenario, and how its file was interpreted, None if it has no file."""

    grid: Grid
    reading: MapReading | None = None


def read_cell(fields: Fields, key: str, grid: Grid | None) -> Cell | None:
    """Read a point of the map frame in metres; return its cell, None if it has a problem or there is no map."""
    point = fields.numbers(key, 2)
    if not point or grid is None:
        return None
    cell = grid.cell_at_m(*point)
    if not grid.contains(cell):
        fields.wrong(key, f"[{point[0]:g}, {point[1]:g}] is outside the map")
        return None
    return cell


def read_map_field(top: Fields, terrains: tuple[Terrain, ...], folder: Path) -> MapField | None:
    """Read ``map``, with paths relative to `folder`; return None, with problems noted, if it has any."""
    fields = top.part("map")
    before = len(top.problems)
    if not isinstance(top.data.get("map"), Mapping):
        return None
    sources = [source for source in SOURCES if fields.has(source)]
    if len(sources) != 1:
        fields.wrong("", f"needs one of {', '.join(SOURCES)}, got {' and '.join(sources) or 'none'}")
        fields.finish(also=_KEYS)
        return None
    for other in SOURCES:
        if other != sources[0]:
            fields.refuse(other, "")  # it is absent; this keeps it out of the list of allowed fields
    read = {"file": _from_file, "generator": _from_generator, "rows": _from_rows}[sources[0]]
    found = read(fields, terrains, folder)
    mask = _read_mask(fields, terrains)
    filters = read_filters(fields, terrains, folder)
    fields.finish()
    if found is None:
        return None
    grid = replace(found.grid, terrains=terrains)
    if mask is not None:
        try:
            frame = None if found.reading is None else found.reading.frame
            grid = read_mask(grid, in_folder(folder, mask[0]), mask[1], frame)
        except MapError as error:
            note_file(fields, "mask", error)
    return None if len(top.problems) > before else MapField(filters.painted(grid), found.reading)


def _from_file(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> MapField | None:
    before = len(fields.problems)
    name = fields.text("file")
    resolution_m = None
    if name and not has_scale(folder / name):
        resolution_m = fields.quantity("resolution_m") if fields.has("resolution_m") else None
    else:
        fields.refuse("resolution_m", "a nav2 map has its own: 'resolution' in its yaml")
    if not name or len(fields.problems) > before:
        return None
    try:
        reading = read_map(in_folder(folder, name), resolution_m)
    except MapError as error:
        note_file(fields, "file", error)
        return None
    return MapField(reading.grid, reading)


def _from_generator(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> MapField | None:
    before = len(fields.problems)
    name = fields.choice("generator", GENERATORS, what="generator")
    numbers = {key: fields.number(key, None, BOUNDS["extent_m"]) for key in ("width_m", "height_m")}
    numbers["resolution_m"] = fields.quantity("resolution_m", 0.25)
    seed = fields.count("seed", 1)
    # With an unknown generator, read the options of all: they must not be reported as unknown fields too.
    for entry in [GENERATORS[name]] if name else GENERATORS.values():
        numbers |= {key: fields.number(key, default) for key, default in entry.options.items()}
    if len(fields.problems) > before:
        return None
    try:
        return MapField(GENERATORS[name].make(seed=seed, **numbers))
    except MapError as error:
        fields.take(error)
        return None


def _from_rows(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> MapField | None:
    before = len(fields.problems)
    rows = fields.texts("rows")
    resolution_m = fields.quantity("resolution_m")
    origin = fields.numbers("origin_m", 3, (0.0, 0.0, 0.0))
    cells = drawn_cells(rows, _read_legend(fields), terrains, fields)
    if len(fields.problems) > before:
        return None
    return MapField(Grid(cells=cells, resolution_m=resolution_m, origin_m=(origin[0], origin[1], origin[2])))


def drawn_cells(
    rows: Sequence[str], legend: Mapping[str, str], terrains: tuple[Terrain, ...], notes: Notes
) -> CellArray:
    """Return the map drawn in rows of characters, which `legend` extends; valid only if no problem was noted."""
    before = len(notes.problems)
    symbols = SYMBOLS | _legend_codes(legend, terrains, notes.below("legend"))
    if rows and not rows[0]:
        notes.wrong("rows[0]", "is empty")
    for i, row in enumerate(rows):
        if len(notes.problems) - before >= _MOST_ROWS:
            break
        if len(row) != len(rows[0]):
            notes.wrong(f"rows[{i}]", f"has {len(row)} characters, the first row has {len(rows[0])}")
        for symbol in sorted(set(row) - symbols.keys())[:_MOST_SYMBOLS]:
            notes.wrong(f"rows[{i}]", f"unknown character {symbol!r} at column {row.index(symbol)}")
    drawn = rows if len(notes.problems) == before else ()
    return np.array([[symbols[symbol] for symbol in row] for row in reversed(drawn)], dtype=np.uint8)


def _read_legend(fields: Fields) -> dict[str, str]:
    legend = fields.part("legend", required=False)
    for symbol in legend.data:
        if not isinstance(symbol, str):
            legend.wrong(str(symbol), _NO_SYMBOL)
    return {symbol: legend.text(symbol) for symbol in legend.data if isinstance(symbol, str)}


def _legend_codes(legend: Mapping[str, str], terrains: tuple[Terrain, ...], notes: Notes) -> dict[str, int]:
    codes: dict[str, int] = {}
    for symbol, name in legend.items():
        if len(symbol) != 1 or symbol in SYMBOLS:
            notes.wrong(symbol, _NO_SYMBOL)
        elif (code := terrain_code(notes, symbol, name, terrains)) is not None:
            codes[symbol] = code
    return codes


def _read_mask(fields: Fields, terrains: tuple[Terrain, ...]) -> tuple[str, dict[int, int]] | None:
    if not fields.has("mask"):
        return None
    mask = fields.part("mask")
    file = mask.text("file")
    greys = mask.part("greys")
    codes = mask_codes(_greys(greys), terrains, greys)
    mask.finish()
    return (file, codes) if file else None


def _greys(fields: Fields) -> Iterator[tuple[str, list[int]]]:
    """Read ``greys`` of a mask: yield each terrain's name with its greys."""
    for name, values in fields.data.items():
        given = values if isinstance(values, list) else [values]
        wrong = [grey for grey in given if not is_whole(grey) or not 0 <= grey <= 255]
        for grey in wrong:
            fields.wrong(str(name), f"must be a grey from 0 to 255 or a list of them, got {shown(grey)}")
        yield str(name), [] if wrong else given


def mask_codes(
    greys: Iterable[tuple[str, Sequence[int]]], terrains: tuple[Terrain, ...], notes: Notes
) -> dict[int, int]:
    """Return the terrain code of each grey of a mask, from the greys of each terrain."""
    names = {terrain.name: terrain.code for terrain in terrains}
    codes: dict[int, int] = {}
    for name, values in greys:
        if name not in names:
            notes.wrong(name, unknown("terrain", name, names))
            continue
        for grey in values:
            if codes.setdefault(grey, names[name]) != names[name]:
                notes.wrong(name, f"grey {grey} is given to two terrains")
    return codes


PERCENT = Bound(0, 100, "%", above=True)


def read_filters(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> FilterMasks:
    """Read the masks of a ``map``, with paths relative to `folder`; they are valid only if no problem was noted."""
    keepout = _read_keepout(fields.part("keepout"), terrains, folder) if fields.has("keepout") else None
    speed = _read_speed(fields.part("speed"), terrains, folder) if fields.has("speed") else None
    return FilterMasks(keepout=keepout, speed=speed)


def _mask(fields: Fields, folder: Path, file: str) -> Occupancy | None:
    """Return the mask that ``file`` names; None, with its problems noted, if it can't be read."""
    if not file:
        return None
    try:
        return read_occupancy(in_folder(folder, file))
    except MapError as error:
        note_file(fields, "file", error)
        return None


def note_file(fields: Fields, key: str, error: MapError) -> None:
    """Note the problems of a file that a field names, with the file's path if it is known."""
    for problem in error.problems:
        text = f"{error.source}: {problem}" if error.source else str(problem)
        fields.problems.append(Problem(fields.at(key), text))


def _read_keepout(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> KeepoutMask | None:
    file = fields.text("file")
    ground = [terrain for terrain in terrains if terrain.code != OBSTACLE]
    code = terrain_code(fields, "terrain", fields.text("terrain"), ground)
    fields.finish()
    occupancy = _mask(fields, folder, file)
    return None if occupancy is None or code is None else KeepoutMask(occupancy=occupancy, code=code)


def _read_speed(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> SpeedMask | None:
    file = fields.text("file")
    steps = fields.part("terrains")
    percents, ground = {}, [terrain for terrain in terrains if terrain.code != OBSTACLE]
    for name in map(str, steps.data):  # YAML's keys may be numbers
        if (code := terrain_code(steps, name, name, ground)) is not None:
            percents[code] = steps.number(name, None, PERCENT)
    base, multiplier = fields.number("base", BASE), fields.number("multiplier", MULTIPLIER)
    fields.finish()
    occupancy = _mask(fields, folder, file)
    if occupancy is None:
        return None
    return SpeedMask(occupancy=occupancy, percents=percents, base=base, multiplier=multiplier)


def terrain_code(notes: Notes, key: str, name: str, terrains: Iterable[Terrain]) -> int | None:
    """Return the code of a terrain; None, with a problem noted, if there is none of that name."""
    codes = {terrain.name: terrain.code for terrain in terrains}
    if name and name not in codes:
        notes.wrong(key, unknown("terrain", name, codes))
    return codes.get(name)
