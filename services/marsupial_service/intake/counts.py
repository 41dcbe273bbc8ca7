"""Limits on the number of items in a body, checked before any of it is validated.

A list of a million robots is refused by its length: to say what is wrong with each of them would take longer than to
plan for them. The limits stand in the schemas (`at_most`), so the OpenAPI document shows the same ones.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from pydantic import BaseModel

from marsupial_service.problems import check_count, pointer
from marsupial_service.schemas.base import COUNTED, LIMIT
from marsupial_service.schemas.shapes import EACH, parts_of, schema_of
from marsupial_service.settings import ServiceLimits

_FIXED = ("maxItems", "maxProperties", "maxLength")


class Count(NamedTuple):
    """A list, mapping or text that stands at `path`, and how many items it may have: a number, or the limit's name."""

    path: tuple[str, ...]
    limit: str | int
    noun: str


def counts_of(model: type[BaseModel]) -> tuple[Count, ...]:
    """Return all counts of the bodies of a model, what contains others before these."""
    document = schema_of(model)
    return tuple(dict.fromkeys(_counts(document, document.get("$defs", {}), ())))


def _counts(schema: Mapping[str, Any], models: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[Count]:
    if COUNTED in schema:
        limit = schema.get(LIMIT) or next(schema[key] for key in _FIXED if key in schema)
        yield Count(path, limit, schema[COUNTED])
    for part, inner in parts_of(schema, models):
        yield from _counts(inner, models, (*path, *part))


def check_counts(document: object, counts: Sequence[Count], limits: ServiceLimits) -> None:
    """Raise HttpProblem if a body has too many of anything; what has another shape is left to its model."""
    for count in counts:
        most = count.limit if isinstance(count.limit, int) else int(getattr(limits, count.limit))
        for path, value in _found(document, count.path, ()):
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
    if first == EACH:
        for key, item in enumerate(value) if isinstance(value, list) else _fields(value).items():
            yield from _found(item, rest, (*so_far, key))
    elif first in _fields(value):
        yield from _found(value[first], rest, (*so_far, first))


def _fields(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}
