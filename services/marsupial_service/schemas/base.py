"""The base of all models: strict types, no unknown fields, fields that may be absent but never null.

Numbers lie within `marsupial.model.bounds`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Self, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    GetPydanticSchema,
    StringConstraints,
    Tag,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from marsupial.model.bounds import BOUNDS, LONGEST_NAME, LONGEST_TEXT
from marsupial.model.grid import Cell
from marsupial_service.timestamps import timestamp

T = TypeVar("T")


class RequestBody(BaseModel):
    """A part of a request's body."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Answer(BaseModel):
    """A part of an answer's body."""

    model_config = ConfigDict(extra="forbid", frozen=True, from_attributes=True)

    @classmethod
    def of(cls, value: object, **more: object) -> Self:
        """Return the answer for a value: its attributes with the names of the fields, and `more`.

        Moments become text: `created_at` is made of the attribute `created_at_ms`.
        """
        found = dict(more)
        for name in cls.model_fields.keys() - more.keys():
            if name.endswith("_at"):
                ms = getattr(value, f"{name}_ms")
                found[name] = None if ms is None else timestamp(ms)
            else:
                found[name] = getattr(value, name)
        return cls.model_validate(found)


class _NeverNull:
    """Describes a field that may be absent as one that is never null."""

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        schema = handler(core)
        variants = [variant for variant in schema.pop("anyOf", []) if variant != {"type": "null"}]
        if len(variants) == 1:
            return {**schema, **variants[0]}
        return {**schema, "anyOf": variants} if variants else schema


class _RefuseNull(_NeverNull):
    """Refuses null where a field is given."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(_refuse_null, handler(source))


def _refuse_null(value: object) -> object:
    if value is None:
        raise PydanticCustomError("null", "must not be null; omit the field")
    return value


def within(name: str) -> Any:
    """Return the constraint that a number lies within the bound of that name."""
    bound = BOUNDS[name]
    return Field(gt=bound.least, le=bound.most) if bound.above else Field(ge=bound.least, le=bound.most)


_MOST = {"array": "maxItems", "object": "maxProperties", "string": "maxLength"}


@dataclass(frozen=True, slots=True)
class _AtMost:
    """Describes the bound of a list, mapping or text; `intake.counts` enforces it before anything is validated."""

    limit: str | int
    noun: str

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        schema = handler(core)
        key = LIMIT if isinstance(self.limit, str) else _MOST[schema["type"]]
        return {**schema, key: self.limit, COUNTED: self.noun}


LIMIT, COUNTED = "x-limit", "x-counted"
"""Keys of a schema: the limit (of `/v1/limits`) on its number of items, and what these are."""


def at_most(limit: str | int, noun: str) -> Any:
    """Return the constraint that a list, mapping or text has at most so many items: a number, or a limit's name."""
    return _AtMost(limit, noun)


def enum_schema(words: type[StrEnum]) -> GetPydanticSchema:
    """Return the schema of a text that is one of these words; the document lists them at the field."""
    return GetPydanticSchema(lambda *_: core_schema.literal_schema([word.value for word in words]))


def described_by(shape: Any) -> GetPydanticSchema:
    """Describe a field by `shape` in the OpenAPI document, but don't validate it: another reader does."""
    return GetPydanticSchema(
        lambda _, handler: core_schema.no_info_wrap_validator_function(lambda value, _: value, handler(shape))
    )


def converted(shape: Any, make: Callable[..., Any]) -> GetPydanticSchema:
    """Return the schema of a field that is sent in a shape (a model, or a type of JSON) and becomes a value.

    `make` takes the fields of a model by their names, anything else as it is.
    """

    def value_of(sent: Any) -> Any:
        return make(**dict(sent)) if isinstance(sent, BaseModel) else make(sent)

    return converted_list(shape, value_of)


def converted_list(shape: Any, make: Callable[[Any], Any]) -> GetPydanticSchema:
    """Return the same for a list, given to `make` without a wrapper: a report may have thousands of cells.

    Code may give the value itself, where the shape takes any sequence (`strict=False`); it is dumped as a list.
    """
    dumped = core_schema.simple_ser_schema("any")
    return GetPydanticSchema(
        lambda _, handler: core_schema.no_info_after_validator_function(make, handler(shape), serialization=dumped)
    )


OptionalField = Annotated[T | None, _RefuseNull()]
"""A field of a request that may be left out, with None as its default."""

OmittedIfNone = Annotated[T | None, Field(exclude_if=lambda value: value is None), _NeverNull()]
"""A field of an answer that is left out where it is None."""

Name = Annotated[str, StringConstraints(min_length=1, max_length=LONGEST_TEXT, pattern=r"\S")]
RobotName = Annotated[str, StringConstraints(max_length=LONGEST_NAME, pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
Milliseconds = Annotated[int, within("duration_ms")]
Power = Annotated[float, within("power_w")]
Metres = Annotated[float, within("coordinate_m")]
PointM = Annotated[
    tuple[float, float], converted_list(Annotated[list[Metres], Field(min_length=2, max_length=2)], tuple)
]
CellXY = Annotated[
    Cell,
    converted_list(
        Annotated[list[Annotated[int, within("cell")]], Field(min_length=2, max_length=2, strict=False)], Cell._make
    ),
]


def one_of(*keys: str) -> dict[str, Any]:
    """Return the schema of an object that has exactly one of these fields."""
    return {"oneOf": [{"required": [key]} for key in keys]}


SeatsByType = Annotated[dict[str, Annotated[int, within("capacity")]], Field(min_length=1)]
"""The most rovers of each type aboard a carrier."""

VARIANT = "\0"
"""Prefix of the tags of variants, by which `problems` finds them in the locations of pydantic's errors."""


def variant(key: str) -> Tag:
    """Return the tag of the variant that has the field `key`."""
    return Tag(VARIANT + key)


NO_VARIANT = "none_of"
"""The error of an object that has none of the `keys` that distinguish its variants."""


def by_key(*keys: str) -> Discriminator:
    """Return a discriminator that tells variants apart by which of `keys` they have."""

    def tag(value: Any) -> str | None:
        if not isinstance(value, Mapping):
            return VARIANT + keys[0]  # its model reports the error
        return next((VARIANT + key for key in keys if key in value), None)

    return Discriminator(
        tag,
        custom_error_type=NO_VARIANT,
        custom_error_message=f"must have one of the fields {', '.join(keys)}",
        custom_error_context={"keys": " ".join(keys)},
    )
