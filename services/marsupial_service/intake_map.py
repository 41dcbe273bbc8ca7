"""From the JSON of a map state, whose shape is known to be right, to a `MapState`.

Maps, terrains and robot types are read as in scenario files. The size in an image's header is looked at before the
image is decoded.
"""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from marsupial.errors import MapError, Problem, ScenarioError
from marsupial.formats.fields import Fields
from marsupial.formats.mapfiles.images import GreyImage, grey_of, size_of
from marsupial.formats.mapfiles.nav2 import understand_image
from marsupial.formats.mapfiles.nav2_header import Mode, Nav2Header, header_of
from marsupial.formats.mapfiles.terrain_mask import apply_mask
from marsupial.formats.scenario.map import read_greys, read_rows, read_terrains
from marsupial.formats.scenario.read import read_types
from marsupial.formats.scenario.team import Kinds
from marsupial.formats.situation import read_goal
from marsupial.model.grid import Grid, Terrain
from marsupial_service.intake import check_count, refusing
from marsupial_service.intake_robots import read_homes, read_meetings, read_robots
from marsupial_service.mapstate import MapState
from marsupial_service.settings import Limits

MOST_RADIUS_CELLS = 200
"""Of a robot: what the cells under its footprint cost goes with the square."""

_PREFIX = "/map_state"


def read_map_state(body: Mapping[str, Any], limits: Limits) -> MapState:
    """Return the map state of a request.

    Raises
    ------
    HttpProblem
        Naming everything that is wrong, or what there is too much of.
    """
    fields = body["map_state"]
    check_count(f"{_PREFIX}/robots", len(fields["robots"]), limits.robots, "robots")
    check_count(f"{_PREFIX}/robot_types", len(fields["robot_types"]), limits.robots, "robot types")
    with refusing(_PREFIX, fields):
        problems: list[Problem] = []
        state = _read(Fields(fields, "", problems), limits)
        if problems or state is None:
            raise ScenarioError(problems)
        return state


def _read(top: Fields, limits: Limits) -> MapState | None:
    terrains = read_terrains(top)
    grid = _read_grid(top, terrains, limits)
    kinds = read_types(top, terrains)
    goal = read_goal(top.part("goal", required=False))
    if grid is None or top.problems:
        return None
    check_radii(top, kinds, grid.resolution_m)
    robots = read_robots(top, kinds, grid)
    return MapState(
        grid=grid,
        kinds=tuple(kind for kind in kinds.values() if kind is not None),
        robots=robots,
        homes=read_homes(top, kinds, grid, goal),
        meetings=read_meetings(top, kinds, grid),
        goal=goal,
    )


def _read_grid(top: Fields, terrains: tuple[Terrain, ...], limits: Limits) -> Grid | None:
    fields = top.part("map")
    before = len(top.problems)
    if fields.has("rows"):
        rows = fields.data["rows"]
        check_count(f"{_PREFIX}/map/rows", len(rows) * len(rows[0]), limits.cells, "cells")
        grid = read_rows(fields, terrains)
    else:
        grid = _from_image(fields, limits)
    grid = None if grid is None else replace(grid, terrains=terrains)
    if grid is not None and fields.has("mask"):
        grid = _masked(grid, fields.part("mask"), terrains, limits)
    return grid if len(top.problems) == before else None


def _from_image(fields: Fields, limits: Limits) -> Grid | None:
    if fields.has("nav2"):
        part = fields.part("nav2")
        header = _read_yaml(part)
        image = _read_image(part, limits)
    else:
        header = _read_header(fields)
        image = _read_image(fields, limits)
    return None if header is None or image is None else understand_image(header, image).grid


def _read_yaml(fields: Fields) -> Nav2Header | None:
    try:
        return header_of(fields.data["yaml"].encode())
    except MapError as error:
        for problem in error.problems:
            fields.wrong("yaml", str(problem))
        return None


def _read_header(fields: Fields) -> Nav2Header | None:
    free, occupied = fields.number("free_thresh", 0.25), fields.number("occupied_thresh", 0.65)
    if free > occupied:
        fields.wrong("free_thresh", f"must not be above occupied_thresh ({occupied:g}), got {free:g}")
        return None
    x, y, yaw = fields.numbers("origin_m", 3, (0.0, 0.0, 0.0))
    return Nav2Header(
        image=Path("image"),
        resolution_m=fields.number("resolution_m"),
        origin_m=(x, y, yaw),
        negate=fields.flag("negate", False),
        free_thresh=free,
        occupied_thresh=occupied,
        mode=Mode(fields.text("mode", Mode.TRINARY)),
    )


def _read_image(fields: Fields, limits: Limits) -> GreyImage | None:
    """Decode ``image``, if it isn't larger than any map may be."""
    path = fields.at("image")
    try:
        data = base64.b64decode(fields.data["image"], validate=True)
        width, height = size_of(data, field=path)
        check_count(f"{_PREFIX}/{path.replace('.', '/')}", width * height, limits.cells, "pixels")
        return grey_of(data, field=path, max_cells=limits.cells)
    except binascii.Error as error:
        fields.wrong("image", f"is not base64 ({error})")
    except MapError as error:
        fields.problems.extend(error.problems)
    return None


def _masked(grid: Grid, fields: Fields, terrains: tuple[Terrain, ...], limits: Limits) -> Grid | None:
    before = len(fields.problems)
    codes, image = read_greys(fields, terrains), _read_image(fields, limits)
    if image is None or len(fields.problems) > before:
        return None
    try:
        return apply_mask(grid, image, codes)
    except MapError as error:
        for problem in error.problems:
            fields.wrong("image", str(problem))
        return None


def check_radii(top: Fields, kinds: Kinds, resolution_m: float) -> None:
    """Note robot types that are too big for the cells."""
    for i, kind in enumerate(kinds.values()):
        if kind is not None and kind.radius_m > MOST_RADIUS_CELLS * resolution_m:
            top.wrong(f"robot_types[{i}].radius_m", f"must be at most {MOST_RADIUS_CELLS} cells of the map")
