"""Walk the JSON schema of a model: what stands inside of what, by which names."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel

# in a path: every item of a list, or value of a mapping
EACH = "*"

Schema = Mapping[str, Any]


@cache
def schema_of(model: type[BaseModel]) -> Schema:
    """Return the JSON schema of a model, which has those it refers to in `$defs`."""
    return model.model_json_schema()


def parts_of(schema: Schema, models: Schema) -> Iterator[tuple[tuple[str, ...], Schema]]:
    """Yield the schemas that a schema has inside, each with its path from there; `models` are those it refers to."""
    if "$ref" in schema:
        yield (), models[schema["$ref"].rpartition("/")[2]]
    for variants in ("anyOf", "oneOf", "allOf"):
        for variant in schema.get(variants, ()):
            yield (), variant
    for name, inner in schema.get("properties", {}).items():
        yield (name,), inner
    for every in ("items", "additionalProperties"):
        if isinstance(schema.get(every), Mapping):
            yield (EACH,), schema[every]


def fields_at(model: type[BaseModel], location: Sequence[str | int]) -> set[str]:
    """Return the names of the fields that a body may have at a location of pydantic's, in any variant."""
    top = schema_of(model)
    models = top.get("$defs", {})
    here = _variants(top, models)
    for part in location:
        steps = {(EACH,)} if isinstance(part, int) else {(part,), (EACH,)}
        inner = [one for schema in here for step, one in parts_of(schema, models) if step in steps]
        if inner:  # else it is the tag of a variant
            here = [variant for one in inner for variant in _variants(one, models)]
    return {name for schema in here for name in schema.get("properties", {})}


def _variants(schema: Schema, models: Schema) -> list[Schema]:
    """Return a schema and all that may stand in its place."""
    return [schema, *(one for step, part in parts_of(schema, models) if not step for one in _variants(part, models))]
