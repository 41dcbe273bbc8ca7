"""What can be read off a map, as GeoJSON in metres of the map frame.

It runs in a worker: `analyse` is the function of a job, `load_analysis` loads its compiled code ahead.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from itertools import permutations
from typing import Any

import numpy as np

from marsupial.errors import InputError
from marsupial.formats.fields import Notes
from marsupial.formats.situation import situation_to_json
from marsupial.maps.growth import reach_of
from marsupial.maps.survey import placed
from marsupial.maps.territory import Territory
from marsupial.model.grid import Cell
from marsupial_service.analyses.maps import MapState
from marsupial_service.analyses.outlines import polygons
from marsupial_service.entries.documents import rounded, text_of
from marsupial_service.problems import HttpProblem, problem_of
from marsupial_service.schemas.answers import AnalysisAnswer, FeatureAnswer, Geometry, GeometryAnswer


def analyse(argument: tuple[MapState, frozenset[str], int]) -> Iterator[bytes | HttpProblem]:
    """Yield the analysis as JSON text of at most so many bytes, or what is wrong with the map state."""
    state, include, most_bytes = argument
    try:
        text = text_of(analysis(state, include)).encode()
    except InputError as error:
        below = Notes("map_state")
        below.take(error)
        yield problem_of(InputError(below.problems), None)
        return
    if len(text) > most_bytes:
        yield HttpProblem("too-large", f"the answer has {len(text)} bytes, more than {most_bytes}: include less")
    else:
        yield text


def analysis(state: MapState, include: frozenset[str]) -> AnalysisAnswer:
    """Return the feature collection of a map state; `include` are some of `INCLUDE`."""
    features = [feature for name, found in _FEATURES.items() if name in include for feature in found(state)]
    situation = json.loads(situation_to_json(state.situation()))
    return AnalysisAnswer(type="FeatureCollection", features=features, situation=situation)


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
            told = {"what": kinds.get(place, "start"), "name": place, "robot_type": kind, "cell": list(cell), **more}
            yield _feature(f"{place}/{kind}", "Point", _centre(state, cell), told)


def _frontiers(state: MapState) -> Iterator[FeatureAnswer]:
    width = state.grid.width
    for target in state.survey.targets:
        points = [_centre(state, Cell(int(i) % width, int(i) // width)) for i in target.cells]
        told = {"what": "frontier", "name": target.name, "explorers": sorted(target.viewpoints)}
        yield _feature(f"{target.name}/frontier", "MultiPoint", points, told)


def _reach(state: MapState) -> Iterator[FeatureAnswer]:
    reach = reach_of(Territory(state.grid, state.kinds), placed(state.robots))
    for kind, mask in sorted(reach.by_type.items()):
        rings = [
            [[rounded(state.grid.point_m(*corner)) for corner in ring] for ring in polygon]
            for polygon in polygons(mask)
        ]
        area_m2 = float(np.count_nonzero(mask) * state.grid.cell_area_m2)
        told = {"what": "reach", "robot_type": kind, "area_m2": area_m2}
        yield _feature(f"reach/{kind}", "MultiPolygon", rings, told)


def _costs(state: MapState) -> Iterator[FeatureAnswer]:
    """Yield a straight line for each drive there is, with the time it takes on the way the robot really goes."""
    situation, poses = state.situation(), state.survey.poses
    for kind in (one.name for one in situation.types):
        for origin, goal in permutations(situation.places, 2):
            travel_ms = situation.travel(kind, origin, goal)
            if travel_ms is not None:
                ends = [_centre(state, poses[place][kind]) for place in (origin, goal)]
                told = {"what": "cost", "robot_type": kind, "origin": origin, "place": goal, "travel_ms": travel_ms}
                yield _feature(f"cost/{kind}/{origin}/{goal}", "LineString", ends, told)


def _centre(state: MapState, cell: Cell) -> list[float]:
    return rounded(state.grid.centre_m(cell))


_FEATURES: Mapping[str, Callable[[MapState], Iterator[FeatureAnswer]]] = {
    "places": _places,
    "frontiers": _frontiers,
    "reach": _reach,
    "costs": _costs,
}
INCLUDE = frozenset(_FEATURES)
