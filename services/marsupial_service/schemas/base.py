"""What all models have in common: strict types, no unknown fields, fields that may be absent but never null."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    StringConstraints,
    Tag,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

LONGEST_MS = 10**12
MOST = 1e15

T = TypeVar("T")


class Request(BaseModel):
    """A part of a request's body."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Answer(BaseModel):
    """A part of an answer's body."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class _NotNull:
    """Refuses null where a field is given."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(_refuse_null, handler(source))

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        schema = handler(core)
        variants = [variant for variant in schema.pop("anyOf", []) if variant != {"type": "null"}]
        if len(variants) == 1:
            return {**schema, **variants[0]}
        return {**schema, "anyOf": variants} if variants else schema


def _refuse_null(value: object) -> object:
    if value is None:
        raise PydanticCustomError("null", "must not be null; leave the field out")
    return value


Maybe = Annotated[T | None, _NotNull()]
"""A field that may be left out, with None as its default."""

Name = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"\S")]
RobotName = Annotated[str, StringConstraints(max_length=100, pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
Milliseconds = Annotated[int, Field(ge=0, le=LONGEST_MS)]
Seconds = Annotated[float, Field(ge=0, le=1e9)]
Metres = Annotated[float, Field(ge=-MOST, le=MOST)]
PointM = Annotated[list[Metres], Field(min_length=2, max_length=2)]
CellXY = Annotated[list[Annotated[int, Field(ge=0, le=10**9)]], Field(min_length=2, max_length=2)]


def one_of(*keys: str) -> dict[str, Any]:
    """Return the schema of an object that has exactly one of these fields."""
    return {"oneOf": [{"required": [key]} for key in keys]}


VARIANT = "\0"
"""What the words begin with by which pydantic tells `variant` and `by_key` apart in the places of errors."""


def variant(key: str) -> Tag:
    """Return the tag of the variant that has the field `key`."""
    return Tag(VARIANT + key)


def by_key(*keys: str) -> Discriminator:
    """Return a discriminator that tells variants apart by which of `keys` they have; the first one by default."""

    def tag(value: Any) -> str:
        fields = value if isinstance(value, Mapping) else {}
        return VARIANT + next((key for key in keys if key in fields), keys[0])

    return Discriminator(tag)
