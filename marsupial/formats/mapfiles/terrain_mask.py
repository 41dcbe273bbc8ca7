"""Terrain classes from a second image of the map's size.

The grey of the mask gives the class of each known cell without obstacle. Walls, unknown cells and cells under
transparent pixels don't change, whatever is painted there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from marsupial.errors import MapError, Problem
from marsupial.formats.files import raise_any
from marsupial.formats.mapfiles.images import GreyImage, read_grey
from marsupial.model.grid import OBSTACLE, UNKNOWN, Grid
from marsupial.wording import counted


def read_mask(grid: Grid, mask_path: Path | str, codes: Mapping[int, int]) -> Grid:
    """Return the grid with the terrain classes of a mask image in a file; see `apply_mask`."""
    source = str(mask_path)
    _check_codes(codes, grid, source)
    return apply_mask(grid, read_grey(Path(mask_path), field="mask", source=source), codes, source=source)


def apply_mask(grid: Grid, mask: GreyImage, codes: Mapping[int, int], *, source: str = "") -> Grid:
    """Return the grid with the terrain classes of a mask image.

    `codes`: terrain codes of the grid by grey (0 to 255); every grey on a known cell without obstacle needs one.
    """
    _check_codes(codes, grid, source)
    if mask.grey.shape != grid.cells.shape:
        height, width = mask.grey.shape
        text = f"must be that of the map, {grid.width} x {grid.height}, got {width} x {height}"
        raise MapError([Problem("size", text)], source=source)
    greys = np.flipud(mask.grey)
    takes = (grid.cells != OBSTACLE) & (grid.cells != UNKNOWN)
    if mask.opaque is not None:
        takes &= np.flipud(mask.opaque)
    counts = np.bincount(greys[takes], minlength=256)
    unlisted = [int(g) for g in np.flatnonzero(counts) if int(g) not in codes]
    raise_any([Problem(f"grey {g}", f"has no terrain code ({counted(counts[g], 'cell')})") for g in unlisted], source)
    table = np.zeros(256, dtype=np.uint8)
    table[list(codes)] = list(codes.values())
    return replace(grid, cells=np.where(takes, table[greys], grid.cells))


def _check_codes(codes: Mapping[int, int], grid: Grid, source: str) -> None:
    known = {terrain.code for terrain in grid.terrains}
    problems = [Problem(f"grey {g}", "must be from 0 to 255") for g in codes if not 0 <= g <= 255]
    strange = {g: code for g, code in codes.items() if code not in known}
    text = "terrain code {} is none of the map's classes {}"
    problems += [Problem(f"grey {g}", text.format(code, sorted(known))) for g, code in strange.items()]
    if problems:
        raise MapError(problems, source=source)
