"""The analysis of a map, as GeoJSON in metres of the map frame.

It runs in a worker: `analyse` is the function of a job, `load_analysis` loads its compiled code ahead.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise, permutations
from typing import Any

import numpy as np

from marsupial.errors import InputError
from marsupial.formats.fields import Notes
from marsupial.formats.situation import situation_to_json
from marsupial.maps.describe import edge_warnings
from marsupial.maps.growth import reach_of
from marsupial.maps.survey import placed
from marsupial.maps.territory import Territory
from marsupial.model.grid import Cell, Mask
from marsupial_service.analyses.maps import MapState
from marsupial_service.entries.documents import rounded, text_of
from marsupial_service.problems import HttpProblem, problem_of
from marsupial_service.schemas.answers import AnalysisAnswer, FeatureAnswer, Geometry, GeometryAnswer

Corner = tuple[int, int]
Ring = list[Corner]

_TURNS = ((1, 0), (0, 1), (-1, 0), (0, -1))


def analyse(argument: tuple[MapState, frozenset[str], int]) -> bytes:
    """Return the analysis as JSON text of limited size. Raises HttpProblem."""
    state, include, most_bytes = argument
    try:
        text = text_of(analysis(state, include)).encode()
    except InputError as error:
        below = Notes("map_state")
        below.take(error)
        raise problem_of(InputError(below.problems), None) from error
    if len(text) > most_bytes:
        raise HttpProblem(
            "too-large", f"the answer has {len(text)} bytes, more than the limit of {most_bytes}; include less"
        )
    return text


def analysis(state: MapState, include: frozenset[str]) -> AnalysisAnswer:
    """Return the feature collection of a map state; `include` are some of `INCLUDE`."""
    features = [feature for name, found in _FEATURES.items() if name in include for feature in found(state)]
    situation = json.loads(situation_to_json(state.situation()))
    warnings = list(edge_warnings(state.grid, state.kinds))
    return AnalysisAnswer(type="FeatureCollection", features=features, situation=situation, warnings=warnings)


def _feature(identity: str, geometry: Geometry, coordinates: list[Any], properties: dict[str, Any]) -> FeatureAnswer:
    shape = GeometryAnswer(type=geometry, coordinates=coordinates)
    return FeatureAnswer(type="Feature", id=identity, geometry=shape, properties=properties)


def _places(state: MapState) -> Iterator[FeatureAnswer]:
    """Yield a point for each robot type at each place: types may stand at different cells of it."""
    survey = state.survey
    kinds = {target.name: "target" for target in survey.targets} | {m.name: "meeting" for m in survey.meetings}
    kinds |= dict.fromkeys(survey.situation.homes, "home")
    reveal = {target.name: target.reveal_m2 for target in survey.situation.targets}
    for place, poses in survey.poses.items():
        more = {"reveal_m2": float(reveal[place])} if place in reveal else {}
        for kind, cell in sorted(poses.items()):
            data = {"what": kinds.get(place, "start"), "name": place, "robot_type": kind, "cell": list(cell), **more}
            yield _feature(f"{place}/{kind}", "Point", _centre(state, cell), data)


def _frontiers(state: MapState) -> Iterator[FeatureAnswer]:
    width = state.grid.width
    for target in state.survey.targets:
        points = [_centre(state, Cell(int(i) % width, int(i) // width)) for i in target.cells]
        data = {"what": "frontier", "name": target.name, "explorers": sorted(target.viewpoints)}
        yield _feature(f"{target.name}/frontier", "MultiPoint", points, data)


def _reach(state: MapState) -> Iterator[FeatureAnswer]:
    reach = reach_of(Territory(state.grid, state.kinds), placed(state.robots))
    for kind, mask in sorted(reach.by_type.items()):
        rings = [
            [[rounded(state.grid.point_m(*corner)) for corner in ring] for ring in polygon]
            for polygon in polygons(mask)
        ]
        area_m2 = float(np.count_nonzero(mask) * state.grid.cell_area_m2)
        data = {"what": "reach", "robot_type": kind, "area_m2": area_m2}
        yield _feature(f"reach/{kind}", "MultiPolygon", rings, data)


def _costs(state: MapState) -> Iterator[FeatureAnswer]:
    """Yield a straight line for each possible drive, with the time of the robot's real route."""
    situation, poses = state.situation(), state.survey.poses
    for kind in (one.name for one in situation.types):
        for origin, goal in permutations(situation.places, 2):
            travel_ms = situation.travel(kind, origin, goal)
            if travel_ms is not None:
                ends = [_centre(state, poses[place][kind]) for place in (origin, goal)]
                data = {"what": "cost", "robot_type": kind, "origin": origin, "place": goal, "travel_ms": travel_ms}
                yield _feature(f"cost/{kind}/{origin}/{goal}", "LineString", ends, data)


def _centre(state: MapState, cell: Cell) -> list[float]:
    return rounded(state.grid.centre_m(cell))


_FEATURES: Mapping[str, Callable[[MapState], Iterator[FeatureAnswer]]] = {
    "places": _places,
    "frontiers": _frontiers,
    "reach": _reach,
    "costs": _costs,
}
INCLUDE = frozenset(_FEATURES)


def polygons(mask: Mask) -> list[list[Ring]]:
    """Return the polygons that cover the cells of `mask`: each an outer ring, then its holes.

    Corners are (x, y) with (0, 0) the lower left corner of cell (0, 0). Outer rings run counterclockwise, holes
    clockwise, the first corner is repeated at the end, and only corners where the outline turns are given. Cells that
    touch at a corner only belong to different polygons.
    """
    outer: list[Ring] = []
    holes: list[Ring] = []
    for ring in _rings(_edges(mask)):
        (outer if _area2(ring) > 0 else holes).append(ring)
    found = [[ring] for ring in outer]
    for hole in holes:
        around = [polygon for polygon in found if _is_inside(hole, polygon[0])]
        min(around, key=lambda polygon: _area2(polygon[0])).append(hole)
    return found


def _edges(mask: Mask) -> dict[Corner, list[int]]:
    """Return, for each corner, in which directions the outline goes on, cells to its left."""
    padded = np.pad(mask, 1)
    inner = padded[1:-1, 1:-1]
    edges: dict[Corner, list[int]] = {}
    sides = (
        (padded[:-2, 1:-1], 0, 0, 0),  # below: eastwards along the lower edge
        (padded[1:-1, 2:], 1, 0, 1),  # to the east: northwards
        (padded[2:, 1:-1], 1, 1, 2),  # above: westwards
        (padded[1:-1, :-2], 0, 1, 3),  # to the west: southwards
    )
    for neighbour, dx, dy, direction in sides:
        for y, x in np.argwhere(inner & ~neighbour).tolist():
            edges.setdefault((x + dx, y + dy), []).append(direction)
    return edges


def _rings(edges: dict[Corner, list[int]]) -> list[Ring]:
    rings = []
    while edges:
        start = corner = next(iter(edges))
        heading, walk = edges[start][0], list[tuple[Corner, int]]()
        while not walk or corner != start:
            heading = _next_edge(edges, corner, heading)
            walk.append((corner, heading))
            corner = (corner[0] + _TURNS[heading][0], corner[1] + _TURNS[heading][1])
        headings = [heading, *(one for _, one in walk)]
        ring = [corner for (corner, now), before in zip(walk, headings, strict=False) if now != before]
        rings.append([*ring, ring[0]])
    return rings


def _next_edge(edges: dict[Corner, list[int]], corner: Corner, last: int) -> int:
    """Take the edge on which an outline goes on; where two rings touch it turns left, round the same cell."""
    left = (last + 1) % 4
    heading = left if left in edges[corner] else edges[corner][0]
    edges[corner].remove(heading)
    if not edges[corner]:
        del edges[corner]
    return heading


def _area2(ring: Ring) -> int:
    """Return twice the area, negative for a ring that runs clockwise."""
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairwise(ring))


def _is_inside(hole: Ring, ring: Ring) -> bool:
    """Return whether a hole's first corner, moved half a cell into its cells' side, lies in an outer ring."""
    (x, y), (x1, y1) = hole[0], hole[1]
    dx, dy = np.sign(x1 - x), np.sign(y1 - y)
    px, py = x + 0.5 * dx - 0.5 * dy, y + 0.5 * dy + 0.5 * dx
    crossings = 0
    for (ax, ay), (bx, by) in pairwise(ring):
        if ax == bx and (ay > py) != (by > py) and px < ax:
            crossings += 1
    return crossings % 2 == 1
