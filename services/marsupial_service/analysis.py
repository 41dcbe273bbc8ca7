"""What can be read off a map, as GeoJSON in metres of the map frame.

It runs in a worker: `analyse` is the function of a job, `load_analysis` loads its compiled code ahead.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from marsupial.errors import InputError
from marsupial.formats.situation import situation_to_json
from marsupial.maps.growth import reach_of
from marsupial.maps.survey import Survey, placed
from marsupial.maps.territory import Territory
from marsupial.model.grid import Cell, Grid
from marsupial_service.demo import DEMOS
from marsupial_service.intake_map import map_state_of
from marsupial_service.jobs.documents import rounded
from marsupial_service.mapstate import MapState
from marsupial_service.outlines import polygons
from marsupial_service.schemas.answers import AnalysisAnswer, FeatureAnswer, Geometry, GeometryAnswer
from marsupial_service.schemas.mapstates import MapStateBody
from marsupial_service.settings import ServiceLimits

INCLUDE = ("places", "reach", "frontiers", "costs")


def analyse(argument: tuple[MapState, frozenset[str]]) -> Iterator[AnalysisAnswer | InputError]:
    """Yield the analysis, or what is wrong with the map state."""
    state, include = argument
    try:
        yield analysis(state, include)
    except InputError as error:
        yield error


def load_analysis() -> None:
    """Analyse a small map."""
    yard = map_state_of(MapStateBody.model_validate(DEMOS["yard"].load()), ServiceLimits())
    analysis(yard, frozenset(INCLUDE))


def analysis(state: MapState, include: frozenset[str]) -> AnalysisAnswer:
    """Return the feature collection of a map state.

    Parameters
    ----------
    include
        Which of `INCLUDE` are told.
    """
    survey = state.survey()
    features: list[FeatureAnswer] = []
    if "places" in include:
        features += _places(state.grid, survey)
    if "frontiers" in include:
        features += _frontiers(state.grid, survey)
    if "reach" in include:
        features += _reach(state)
    if "costs" in include:
        features += _costs(state.grid, survey)
    situation = json.loads(situation_to_json(survey.situation))
    return AnalysisAnswer(type="FeatureCollection", features=features, situation=situation)


def _feature(identity: str, geometry: Geometry, coordinates: list[Any], **properties: object) -> FeatureAnswer:
    shape = GeometryAnswer(type=geometry, coordinates=coordinates)
    return FeatureAnswer(type="Feature", id=identity, geometry=shape, properties=properties)


def _places(grid: Grid, survey: Survey) -> list[FeatureAnswer]:
    """Return a point for each robot type at each place: types may stand at different cells of it."""
    kinds = {target.name: "target" for target in survey.targets} | {m.name: "meeting" for m in survey.meetings}
    kinds |= dict.fromkeys(survey.situation.homes, "home")
    reveal = {target.name: target.reveal_m2 for target in survey.situation.targets}
    found = []
    for place, poses in survey.poses.items():
        for kind, cell in sorted(poses.items()):
            more = {"reveal_m2": float(reveal[place])} if place in reveal else {}
            what = kinds.get(place, "start")
            point = rounded(grid.centre_m(cell))
            found.append(
                _feature(
                    f"{place}/{kind}", "Point", point, what=what, name=place, robot_type=kind, cell=list(cell), **more
                )
            )
    return found


def _frontiers(grid: Grid, survey: Survey) -> list[FeatureAnswer]:
    return [
        _feature(
            f"{target.name}/frontier",
            "MultiPoint",
            [rounded(grid.centre_m(Cell(int(i) % grid.width, int(i) // grid.width))) for i in target.cells],
            what="frontier",
            name=target.name,
            explorers=sorted(target.viewpoints),
        )
        for target in survey.targets
    ]


def _reach(state: MapState) -> list[FeatureAnswer]:
    reach = reach_of(Territory(state.grid, state.kinds), placed(state.robots))
    point_m = state.grid.point_m
    return [
        _feature(
            f"reach/{kind}",
            "MultiPolygon",
            [[[rounded(point_m(*corner)) for corner in ring] for ring in polygon] for polygon in polygons(mask)],
            what="reach",
            robot_type=kind,
            area_m2=float(np.count_nonzero(mask) * state.grid.cell_area_m2),
        )
        for kind, mask in sorted(reach.by_type.items())
    ]


def _costs(grid: Grid, survey: Survey) -> list[FeatureAnswer]:
    """Return a straight line for each drive there is, with the time it takes on the way the robot really goes."""
    situation, found = survey.situation, []
    for kind in (one.name for one in situation.types):
        for origin in situation.places:
            for goal in situation.places:
                travel_ms = situation.travel(kind, origin, goal) if origin != goal else None
                if travel_ms is not None:
                    ends = [rounded(grid.centre_m(survey.poses[place][kind])) for place in (origin, goal)]
                    identity = f"cost/{kind}/{origin}/{goal}"
                    found.append(
                        _feature(
                            identity,
                            "LineString",
                            ends,
                            what="cost",
                            robot_type=kind,
                            origin=origin,
                            place=goal,
                            travel_ms=travel_ms,
                        )
                    )
    return found
