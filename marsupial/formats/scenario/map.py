"""The ``map`` and ``terrains`` of a scenario file: from a map file, a generator, or rows in the file itself.

Terrain classes of the scenario are added to those every map has; a mask image may paint them onto the map. Rows are
drawn as the map is seen, the top one first, with one character a cell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.formats.fields import Fields, shown, suggestion
from marsupial.formats.mapfiles.read import read_map
from marsupial.formats.mapfiles.terrain_mask import read_mask
from marsupial.generators import GENERATORS
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, TERRAINS, UNKNOWN, Grid, Terrain

SYMBOLS = {"#": OBSTACLE, ".": FLOOR, "~": ROUGH, "?": UNKNOWN}
"""Characters that need no legend."""

SOURCES = ("file", "generator", "rows")

_KEYS = ("mask", "width_m", "height_m", "resolution_m", "seed", "origin_m", "legend")


def read_terrains(top: Fields) -> tuple[Terrain, ...]:
    """Read the list ``terrains``; return it after the classes that every map has."""
    terrains = list(TERRAINS)
    for fields in top.parts("terrains", required=False):
        name = fields.name("name")
        code = fields.integer("code", _free_code(terrains), at_least=len(TERRAINS), at_most=UNKNOWN - 1)
        blocks_sight = fields.flag("blocks_sight", False)
        fields.finish()
        if name and name in {terrain.name for terrain in terrains}:
            fields.wrong("name", f"{name!r} is used twice")
        elif code and code in {terrain.code for terrain in terrains}:
            fields.wrong("code", f"{code} is used twice")
        elif name and code:
            terrains.append(Terrain(code=code, name=name, blocks_sight=blocks_sight))
    return tuple(terrains)


def read_grid(top: Fields, terrains: tuple[Terrain, ...], folder: Path) -> Grid | None:
    """Read ``map``; return None, with the problems noted, where it is wrong. Paths are relative to `folder`."""
    fields = top.part("map")
    before = len(top.problems)
    if not isinstance(top.data.get("map"), Mapping):
        return None
    sources = [source for source in SOURCES if fields.has(source)]
    if len(sources) != 1:
        fields.wrong("", f"needs one of {', '.join(SOURCES)}, got {' and '.join(sources) or 'none'}")
        fields.finish(also=_KEYS)
        return None
    read = {"file": _from_file, "generator": _from_generator, "rows": read_rows}[sources[0]]
    grid = read(fields, terrains, folder)
    grid = None if grid is None else replace(grid, terrains=terrains)
    mask = _read_mask(fields, terrains)
    fields.finish()
    if grid is not None and mask is not None:
        grid = _masked(grid, folder / mask[0], mask[1], fields)
    return grid if len(top.problems) == before else None


def _free_code(terrains: list[Terrain]) -> int:
    used = {terrain.code for terrain in terrains}
    return next((code for code in range(UNKNOWN) if code not in used), UNKNOWN)


def _from_file(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> Grid | None:
    name = fields.text("file")
    if not name:
        return None
    try:
        return read_map(folder / name).grid
    except MapError as error:
        _note(fields, "file", error)
        return None


def _from_generator(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> Grid | None:
    before = len(fields.problems)
    name = fields.choice("generator", GENERATORS, what="generator")
    numbers = {key: fields.number(key, above=0) for key in ("width_m", "height_m")}
    numbers["resolution_m"] = fields.number("resolution_m", 0.25, above=0)
    seed = fields.integer("seed", 1, at_least=0)
    for entry in [GENERATORS[name]] if name else GENERATORS.values():
        numbers |= {key: fields.number(key, default) for key, default in entry.options.items()}
    if len(fields.problems) > before:
        return None
    try:
        return GENERATORS[name].make(seed=seed, **numbers)
    except MapError as error:
        for problem in error.problems:
            fields.wrong(problem.path, problem.message)
        return None


def read_rows(fields: Fields, terrains: tuple[Terrain, ...], folder: Path = Path()) -> Grid | None:
    """Read a map drawn in rows of characters; return None, with the problems noted, where it is wrong."""
    before = len(fields.problems)
    rows = fields.texts("rows")
    resolution_m = fields.number("resolution_m", above=0)
    origin = fields.numbers("origin_m", 3, (0.0, 0.0, 0.0))
    symbols = SYMBOLS | _read_legend(fields, terrains)
    if rows and not rows[0]:
        fields.wrong("rows[0]", "is empty")
    for i, row in enumerate(rows):
        if len(row) != len(rows[0]):
            fields.wrong(f"rows[{i}]", f"has {len(row)} characters, the first row has {len(rows[0])}")
        for symbol in sorted(set(row) - symbols.keys()):
            fields.wrong(f"rows[{i}]", f"unknown character {symbol!r} at column {row.index(symbol)}")
    if len(fields.problems) > before:
        return None
    cells = np.array([[symbols[symbol] for symbol in row] for row in reversed(rows)], dtype=np.uint8)
    return Grid(cells=cells, resolution_m=resolution_m, origin_m=(origin[0], origin[1], origin[2]))


def _read_legend(fields: Fields, terrains: tuple[Terrain, ...]) -> dict[str, int]:
    """Read ``legend``: a terrain name for each further character of the rows."""
    legend = fields.part("legend", required=False)
    codes = {terrain.name: terrain.code for terrain in terrains}
    symbols = {}
    for symbol in legend.data:
        name = legend.choice(str(symbol), codes, what="terrain") if isinstance(symbol, str) else ""
        if not isinstance(symbol, str) or len(symbol) != 1 or symbol in SYMBOLS:
            legend.wrong(str(symbol), f"must be a text of one character, none of {' '.join(SYMBOLS)}")
        elif name:
            symbols[symbol] = codes[name]
    return symbols


def _read_mask(fields: Fields, terrains: tuple[Terrain, ...]) -> tuple[str, dict[int, int]] | None:
    """Read ``mask``: the image's path, and the terrain code for each grey."""
    if not fields.has("mask"):
        return None
    mask = fields.part("mask")
    file = mask.text("file")
    codes = read_greys(mask, terrains)
    mask.finish()
    return (file, codes) if file else None


def read_greys(mask: Fields, terrains: tuple[Terrain, ...]) -> dict[int, int]:
    """Read ``greys`` of a mask: the terrain code for each grey."""
    greys = mask.part("greys")
    names = {terrain.name: terrain.code for terrain in terrains}
    codes: dict[int, int] = {}
    for name, values in greys.data.items():
        if name not in names:
            greys.wrong(str(name), f"unknown terrain {shown(name)}{suggestion(str(name), names)}")
            continue
        for grey in values if isinstance(values, list) else [values]:
            if isinstance(grey, bool) or not isinstance(grey, int) or not 0 <= grey <= 255:
                greys.wrong(name, f"must be a grey from 0 to 255 or a list of them, got {shown(grey)}")
            elif codes.setdefault(grey, names[name]) != names[name]:
                greys.wrong(name, f"grey {grey} is given to two terrains")
    return codes


def _masked(grid: Grid, path: Path, codes: Mapping[int, int], fields: Fields) -> Grid | None:
    try:
        return read_mask(grid, path, codes)
    except MapError as error:
        _note(fields, "mask", error)
        return None


def _note(fields: Fields, key: str, error: MapError) -> None:
    """Note the problems of a file that a field names, with the file's path as far as it is known."""
    for problem in error.problems:
        text = f"{error.source}: {problem}" if error.source else str(problem)
        fields.problems.append(Problem(fields.at(key), text))
