"""Map states: planning requests before the analysis of their map, converted from bodies of validated shape.

Maps are interpreted as in scenario files.
"""

import base64
import binascii
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from marsupial.errors import MapError, ScenarioError
from marsupial.formats.fields import Fields, Notes
from marsupial.formats.mapfiles.images import GreyImage, Known, check_size, grey_of, size_fault, size_of
from marsupial.formats.mapfiles.masks import apply_mask
from marsupial.formats.mapfiles.nav2 import MAX_YAML_BYTES, Mode, Nav2Header, header_of, understand_image
from marsupial.formats.scenario import is_scenario_text
from marsupial.formats.scenario.map import drawn_cells, mask_codes, read_terrains
from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory
from marsupial.model.grid import Cell, Grid, Terrain
from marsupial.model.mission import MapMeeting
from marsupial.model.robots import RobotType
from marsupial.model.scenario import Goal
from marsupial.model.situation import Situation, SituationGoal
from marsupial.model.sizes import Extent
from marsupial.model.world import RobotReport
from marsupial_service.analyses.team import ORIGIN, chargers_of, check_meetings, homes_of, robots_of, types_of
from marsupial_service.problems import check_count
from marsupial_service.schemas.mapstates import ImageMapBody, MapBody, MapStateBody, MaskBody, Nav2MapBody, RowsMapBody
from marsupial_service.settings import ServiceLimits

_SCENARIO = "this is a marsupial scenario, not a map.yaml; use `marsupial run FILE --server URL`"


@dataclass(frozen=True, kw_only=True, eq=False)
class MapState:
    """The known map, the robots on it (where and when they are free next), meeting points in use, and what is asked.

    `homes` are where carriers have to end if the goal asks for it.
    """

    grid: Grid
    kinds: tuple[RobotType, ...]
    robots: tuple[RobotReport, ...]
    homes: Mapping[str, Cell]
    meetings: tuple[MapMeeting, ...]
    goal: SituationGoal

    @cached_property
    def survey(self) -> Survey:
        """The situation, and what its places are on the map."""
        goal = Goal(recover_rovers=self.goal.recover_rovers, return_home=self.goal.return_home)
        surveyor = Surveyor(Territory(self.grid, self.kinds), self.homes, goal)
        survey = surveyor.survey(self.robots, 0, self.meetings)
        # a mission asks for exploring alone while targets are left; here the goal is what was sent
        return replace(survey, situation=replace(survey.situation, goal=self.goal))

    def situation(self) -> Situation:
        """Return what the planner is asked."""
        return self.survey.situation

    def places(self) -> Mapping[str, object]:
        """Return every place with its cell, and the centre of that in metres, for each robot type that can use it."""
        return {
            name: {
                kind: {"cell": [cell.x, cell.y], "point_m": list(self.grid.centre_m(cell))}
                for kind, cell in sorted(poses.items())
            }
            for name, poses in self.survey.poses.items()
        }


def map_state_of(body: MapStateBody, limits: ServiceLimits) -> MapState:
    """Return the map state of a request, which stands in its field ``map_state``.

    Raises ScenarioError naming everything that is wrong, or HttpProblem if there is too much of something.
    """
    notes = Fields({"terrains": body.terrains, "robot_types": body.robot_types}, "map_state", [])
    terrains = read_terrains(notes)
    grid = _grid(body.map, terrains, limits, notes.below("map"))
    extent = None if grid is None else Extent(grid.cells.size, grid.resolution_m)
    kinds = types_of(notes, terrains, extent, limits)
    notes.check(ScenarioError)
    assert grid is not None
    grid = replace(grid, chargers=chargers_of(body.chargers, grid, notes))
    goal = body.goal or SituationGoal()
    check_meetings(body.meetings, kinds, grid, notes)
    state = MapState(
        grid=grid,
        kinds=tuple(kinds.values()),
        robots=robots_of(body.robots, kinds, grid, notes),
        homes=homes_of(body.robots, kinds, grid, goal, notes),
        meetings=tuple(body.meetings),
        goal=goal,
    )
    notes.check(ScenarioError)
    return state


def image_cells(body: MapBody) -> int:
    """Return how many pixels the images of a map have by their headers; data that is no image counts as none."""
    images = [] if body.mask is None else [body.mask.image]
    if not isinstance(body, RowsMapBody):
        images.append(body.nav2.image if isinstance(body, Nav2MapBody) else body.image)
    pixels = 0
    for image in images:
        with suppress(binascii.Error, MapError):
            pixels += math.prod(size_of(base64.b64decode(image, validate=True)))
    return pixels


def _grid(body: MapBody, terrains: tuple[Terrain, ...], limits: ServiceLimits, notes: Notes) -> Grid | None:
    """Return the map, or None with the problems noted."""
    before = len(notes.problems)
    if isinstance(body, RowsMapBody):
        check_count("/map_state/map/rows", len(body.rows) * len(body.rows[0]), limits.cells, "cells")
        cells = drawn_cells(body.rows, body.legend or {}, terrains, notes)
        origin = body.origin_m or ORIGIN
        grid = Grid(cells=cells, resolution_m=body.resolution_m, origin_m=origin) if cells.size else None
    else:
        grid = _grid_of_image(body, limits, notes)
    grid = None if grid is None else replace(grid, terrains=terrains)
    if grid is not None and body.mask is not None:
        grid = _with_mask(grid, body.mask, limits, notes.below("mask"))
    return grid if len(notes.problems) == before else None


def _grid_of_image(body: ImageMapBody | Nav2MapBody, limits: ServiceLimits, notes: Notes) -> Grid | None:
    if isinstance(body, Nav2MapBody):
        notes = notes.below("nav2")
        header, image = yaml_header(body.nav2.yaml, notes), decoded_image(body.nav2.image, limits, notes)
    else:
        header, image = _header(body, notes), decoded_image(body.image, limits, notes)
    return None if header is None or image is None else understand_image(header, image).grid


def yaml_header(yaml: str, notes: Notes) -> Nav2Header | None:
    """Return the header in the field ``yaml``, or None with the problems noted."""
    data = yaml.encode()
    try:
        return header_of(data)
    except MapError as error:
        is_scenario = len(data) <= MAX_YAML_BYTES and is_scenario_text(yaml)
        for problem in [_SCENARIO] if is_scenario else error.problems:
            notes.wrong("yaml", str(problem))
        return None


def _header(body: ImageMapBody, notes: Notes) -> Nav2Header | None:
    free, occupied = body.free_thresh, body.occupied_thresh
    if free > occupied:
        notes.wrong("free_thresh", f"must not be above occupied_thresh ({occupied:g}), got {free:g}")
        return None
    return Nav2Header(
        image=Path("image"),
        resolution_m=body.resolution_m,
        origin_m=body.origin_m or ORIGIN,
        negate=body.negate,
        free_thresh=free,
        occupied_thresh=occupied,
        mode=Mode(body.mode),
    )


def decoded_image(
    text: str,
    limits: ServiceLimits,
    notes: Notes,
    field: str = "image",
    coarser: int = 1,
    most_coarser: int = 1,
    known: Known | None = None,
    is_mask: bool = False,
) -> GreyImage | None:
    """Return what a field holds, if that isn't larger than any map may be; None with the problems noted.

    `coarser` is how many pixels a side become one cell, `most_coarser` how many may. If `known` is given, only the
    known part of a large image is kept, and counts. A mask may be a smaller file than a map of its size.
    """

    def check(width: int, height: int) -> None:
        least = math.ceil(math.sqrt(width * height / limits.cells))
        helps = least <= most_coarser and size_fault(width, height, len(data)) is None
        advice = f"; with cells {least} times as large it is within it" if helps else ""
        most, pointer = limits.cells * coarser**2, "/" + notes.at(field).replace(".", "/")
        check_count(pointer, width * height, most, "pixels", advice)

    try:
        data = base64.b64decode(text, validate=True)
        size = size_of(data, field=field)
        if known is None:
            check(*size)
        image = grey_of(data, field=field, known=known)
        check(image.grey.shape[1], image.grey.shape[0])
        if not is_mask:
            check_size(image, field=field)
        return image
    except (binascii.Error, ValueError) as error:
        notes.wrong(field, f"is not base64 ({error})")
    except MapError as error:
        notes.take(error)
    return None


def _with_mask(grid: Grid, body: MaskBody, limits: ServiceLimits, notes: Notes) -> Grid | None:
    before = len(notes.problems)
    codes = mask_codes(body.greys.items(), grid.terrains, notes.below("greys"))
    image = decoded_image(body.image, limits, notes, is_mask=True)
    if image is None or len(notes.problems) > before:
        return None
    try:
        return apply_mask(grid, image, codes)
    except MapError as error:
        for problem in error.problems:
            notes.wrong("image", str(problem))
        return None
