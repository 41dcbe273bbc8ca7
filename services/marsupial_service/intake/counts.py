"""How many of everything a body may hold, looked at before any of it is validated.

A list of a million robots is refused by its length: to say what is wrong with each of them would take longer than to
plan for them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from marsupial.model.grid import UNKNOWN
from marsupial.model.sizes import MOST_TYPES
from marsupial_service.problems import check_count, pointer
from marsupial_service.schemas.missions import MOST_REPORTS
from marsupial_service.settings import ServiceLimits

EACH = "*"
"""In a path: every item of a list, or value of a mapping."""

_TERRAINS = UNKNOWN
"""More there are not: codes are one byte, and one of them is for the unknown."""


class Count(NamedTuple):
    """A list, mapping or text that stands at `path`, and how many items it may have."""

    path: tuple[str, ...]
    limit: str | int
    noun: str

    def most(self, limits: ServiceLimits) -> int:
        """Return the number; a word is the name of a limit."""
        return self.limit if isinstance(self.limit, int) else int(getattr(limits, self.limit))


def _at(path: str, limit: str | int, noun: str) -> Count:
    return Count(tuple(path.split(".")), limit, noun)


def _below(path: str, counts: Sequence[Count]) -> tuple[Count, ...]:
    """Return the same counts of what stands at a path."""
    return tuple(count._replace(path=(*path.split("."), *count.path)) for count in counts)


_TYPES = (
    _at("terrains", _TERRAINS, "terrains"),
    _at("robot_types", MOST_TYPES, "robot types"),
    _at("robot_types.*.terrains", _TERRAINS, "terrains"),
)
_MAP_STATE = (
    _at("map_state.map.rows", "cells", "rows"),
    _at("map_state.map.legend", _TERRAINS, "characters"),
    _at("map_state.map.mask.greys", _TERRAINS, "terrains"),
    _at("map_state.map.mask.greys.*", 256, "greys"),
    *_below("map_state", _TYPES),
    _at("map_state.robots", "robots", "robots"),
    _at("map_state.meetings", "places", "meeting points"),
)
_SITUATION = (
    _at("situation.robots", "robots", "robots"),
    _at("situation.types", "robots", "robot types"),
    _at("situation.targets", "targets", "targets"),
    _at("situation.targets.*.explorers", "robots", "robot types"),
    _at("situation.meetings", "places", "places"),
    _at("situation.homes", "places", "places"),
    _at("situation.places", "places", "places"),
    _at("situation.travel_ms", "robots", "robot types"),
    _at("situation.travel_ms.*", "places", "places"),
    _at("situation.travel_ms.*.*", "places", "places"),
)
JOB = (*_MAP_STATE, *_SITUATION)
ANALYSIS = (*_MAP_STATE, _at("include", 10, "words"))
VALIDATION = (*_SITUATION, _at("plan.actions", "actions", "actions"), _at("plan.ipc", "plan_bytes", "characters"))
MISSION = (
    _at("frame.known", "runs", "numbers"),
    _at("area", "runs", "numbers"),
    *_TYPES,
    _at("team", "robots", "robots"),
)
REPORT = (
    _at("revealed", "robots", "robots"),
    _at("revealed.*.runs", "runs", "numbers"),
    _at("map.runs", "runs", "numbers"),
    _at("robots", "robots", "robots"),
    _at("finished", "actions", "commands"),
    _at("failed", "actions", "commands"),
    _at("lost", "robots", "robots"),
)
REPORTS = (
    *REPORT,
    _at("reports", MOST_REPORTS, "reports"),
    *_below(f"reports.{EACH}", REPORT),
)


def check_counts(document: object, counts: Sequence[Count], limits: ServiceLimits) -> None:
    """Raise HttpProblem if a body has too many of anything; what has another shape is left to its model."""
    for count in counts:
        most = count.most(limits)
        for path, value in _found(document, count.path, ()):
            if isinstance(value, list | dict | str) and len(value) > most:
                check_count(pointer(path), len(value), most, count.noun)


def _found(
    value: Any, path: tuple[str, ...], so_far: tuple[str | int, ...]
) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """Yield what stands at a path, with the keys and indices that lead there."""
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
