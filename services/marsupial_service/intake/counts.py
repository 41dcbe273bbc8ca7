"""Limits on the number of items in a body, checked before any of it is validated.

A list of a million robots is refused by its length: to say what is wrong with each of them would take longer than to
plan for them.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from marsupial.formats.scenario.faults import MOST_FAULTS
from marsupial.model.grid import UNKNOWN
from marsupial.model.sizes import MOST_TYPES
from marsupial.model.zones import MOST_CORNERS, MOST_ZONES
from marsupial_service.problems import check_count, pointer
from marsupial_service.schemas.missions import MOST_REPORTS
from marsupial_service.settings import ServiceLimits

# in a path: every item of a list, or value of a mapping
EACH = "*"
# the maximum: codes are one byte, and one of them means unknown
_TERRAINS = UNKNOWN


class Count(NamedTuple):
    """A list, mapping or text that stands at `path`, and how many items it may have: a number, or the limit's name."""

    path: str
    limit: str | int
    noun: str


def _below(path: str, counts: Sequence[Count]) -> tuple[Count, ...]:
    """Return the same counts of what stands at a path."""
    return tuple(count._replace(path=f"{path}.{count.path}") for count in counts)


_TYPES = (
    Count("terrains", _TERRAINS, "terrains"),
    Count("robot_types", MOST_TYPES, "robot types"),
    Count("robot_types.*.terrains", _TERRAINS, "terrains"),
    Count("robot_types.*.seats", MOST_TYPES, "robot types"),
)
_MAP_STATE = (
    Count("map_state.map.rows", "cells", "rows"),
    Count("map_state.map.legend", _TERRAINS, "characters"),
    Count("map_state.map.mask.greys", _TERRAINS, "terrains"),
    Count("map_state.map.mask.greys.*", 256, "greys"),
    *_below("map_state", _TYPES),
    Count("map_state.chargers", "places", "charging places"),
    Count("map_state.robots", "robots", "robots"),
    Count("map_state.meetings", "places", "meeting points"),
)
_SITUATION = (
    Count("situation.robots", "robots", "robots"),
    Count("situation.types", "robots", "robot types"),
    Count("situation.types.*.seats", "robots", "robot types"),
    Count("situation.targets", "targets", "targets"),
    Count("situation.targets.*.explorers", "robots", "robot types"),
    Count("situation.meetings", "places", "places"),
    Count("situation.homes", "places", "places"),
    Count("situation.chargers", "places", "places"),
    Count("situation.places", "places", "places"),
    Count("situation.travel_ms", "robots", "robot types"),
    Count("situation.travel_ms.*", "places", "places"),
    Count("situation.travel_ms.*.*", "places", "places"),
)
JOB = (*_MAP_STATE, *_SITUATION)
ANALYSIS = (*_MAP_STATE, Count("include", 10, "words"))
VALIDATION = (*_SITUATION, Count("plan.actions", "actions", "actions"), Count("plan.ipc", "plan_bytes", "characters"))
MISSION = (
    Count("frame.known", "runs", "numbers"),
    Count("area", "runs", "numbers"),
    Count("zones", MOST_ZONES, "zones"),
    Count("zones.*.polygon_m", MOST_CORNERS, "corners"),
    Count("chargers", "places", "charging places"),
    *_TYPES,
    Count("team", "robots", "robots"),
)
ZONE = (Count("polygon_m", MOST_CORNERS, "corners"),)
SIMULATION = (
    Count("faults", MOST_FAULTS, "faults"),
    Count("starts_m", "robots", "points"),
    Count("zones", MOST_ZONES, "zones"),
    Count("zones.*.polygon_m", MOST_CORNERS, "corners"),
    Count("chargers", "places", "charging places"),
)
REPORT = (
    Count("revealed", "robots", "robots"),
    Count("revealed.*.runs", "runs", "numbers"),
    Count("map.runs", "runs", "numbers"),
    Count("robots", "robots", "robots"),
    Count("finished", "actions", "commands"),
    Count("failed", "actions", "commands"),
    Count("lost", "robots", "robots"),
)
REPORTS = (*REPORT, Count("reports", MOST_REPORTS, "reports"), *_below(f"reports.{EACH}", REPORT))


def check_counts(document: object, counts: Sequence[Count], limits: ServiceLimits) -> None:
    """Raise HttpProblem if a body has too many of anything; what has another shape is left to its model."""
    for count in counts:
        most = count.limit if isinstance(count.limit, int) else int(getattr(limits, count.limit))
        for path, value in _found(document, tuple(count.path.split(".")), ()):
            if isinstance(value, list | dict | str) and len(value) > most:
                check_count(pointer(path), len(value), most, count.noun)


def _found(
    value: Any, path: tuple[str, ...], so_far: tuple[str | int, ...]
) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Yield the values at a path, each with the keys and indices that lead to it."""
    if not path:
        yield so_far, value
        return
    first, rest = path[0], path[1:]
    inner: Mapping[Any, Any] = value if isinstance(value, dict) else {}
    if first == EACH:
        inner = dict(enumerate(value)) if isinstance(value, list) else inner
        for key, item in inner.items():
            yield from _found(item, rest, (*so_far, key))
    elif first in inner:
        yield from _found(inner[first], rest, (*so_far, first))
