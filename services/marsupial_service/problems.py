"""Every error as ``application/problem+json`` (RFC 9457), with pointers to what is wrong in the request.

`KINDS` lists the kinds of errors, `ERROR_KINDS` maps each exception of the library to its kind.

Pointers (RFC 6901) lead to fields. The library names a field by a path (``robots[1].type``), where a key may be any
text, pydantic by a tuple that may hold words that are not in the body. Both are walked through the body itself.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from marsupial import errors as library
from marsupial.errors import InputError, MarsupialError, Problem
from marsupial.formats.fields import shown
from marsupial.model.bounds import Bound
from marsupial.wording import no_option, suggestion
from marsupial_service.schemas.answers import ProblemDetailAnswer
from marsupial_service.schemas.base import NO_VARIANT, VARIANT
from marsupial_service.schemas.shapes import fields_at

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of error: HTTP status and title; clients know it by ``urn:marsupial:problem:<name>``."""

    status: int
    title: str


KINDS: Mapping[str, Kind] = {
    "bad-request": Kind(400, "The request is not valid HTTP"),
    "bad-json": Kind(400, "The body is not valid JSON"),
    "no-key": Kind(401, "An API key is required"),
    "no-scope": Kind(403, "The API key does not allow this"),
    "cross-origin": Kind(403, "The request comes from a page of another origin"),
    "not-found": Kind(404, "Not found"),
    "no-method": Kind(405, "The method is not allowed"),
    "not-acceptable": Kind(406, "The answer is not available in that format"),
    "conflict": Kind(409, "The request conflicts with the current state"),
    "too-slow": Kind(408, "The body did not arrive in time"),
    "too-large": Kind(413, "The request is too large"),
    "media-type": Kind(415, "The body must be JSON"),
    "misdirected": Kind(421, "The request is for another host"),
    "invalid": Kind(422, "The request is invalid"),
    "key-reused": Kind(422, "The idempotency key was used for another request"),
    "too-many": Kind(429, "A limit is reached"),
    "internal": Kind(500, "An internal error occurred"),
    "not-ready": Kind(503, "The service is not ready"),
    "store-full": Kind(507, "The store is full"),
}

ERROR_KINDS: Mapping[type[MarsupialError], str] = {
    library.InputError: "invalid",
    library.MapError: "invalid",
    library.ScenarioError: "invalid",
    library.SituationError: "invalid",
    library.PlanTextError: "invalid",
    library.LogError: "invalid",
    library.UsageError: "invalid",
    library.EngineUnavailable: "invalid",
    library.InvalidPlanError: "invalid",
    library.InternalError: "internal",
}


class HttpProblem(Exception):
    """An error to send to the client, of a `kind` in `KINDS`."""

    def __init__(
        self,
        kind: str,
        detail: str = "",
        *,
        errors: Iterable[ProblemDetailAnswer] = (),
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.kind = kind
        self.title = KINDS[kind].title
        self.detail = detail
        self.errors = tuple(errors)
        self.headers = dict(headers or {})

    def __reduce__(self) -> tuple[object, ...]:
        """Return how to pickle the error, to send it from another process."""
        return partial(HttpProblem, errors=self.errors, headers=self.headers), (self.kind, self.detail)


# the most errors that an answer lists
MOST_ERRORS = 100


def summary(errors: Sequence[ProblemDetailAnswer], count: int) -> str:
    """Return the first of `count` errors in a line, and how many more there are."""
    if not errors:
        return ""
    first = errors[0]
    more = f" (and {count - 1} more)" if count > 1 else ""
    return f"{first.pointer or first.query or first.header or first.path or 'the body'}: {first.detail}{more}"


def check_count(where: str, count: int, limit: int, noun: str, advice: str = "") -> None:
    """Raise HttpProblem if `count` exceeds the limit; `where` is the JSON pointer of the field."""
    if count > limit:
        text = f"has {count:,} {noun}, more than the limit of {limit:,}{advice}"
        raise HttpProblem("too-large", errors=[ProblemDetailAnswer(pointer=where, detail=text)])


def problem_of(error: MarsupialError, document: object) -> HttpProblem:
    """Return the problem for a library error about the body `document`; raise one that is not the client's fault."""
    kind = next(ERROR_KINDS[cls] for cls in type(error).__mro__ if cls in ERROR_KINDS)
    if KINDS[kind].status >= 500:
        raise error
    if not isinstance(error, InputError):
        return HttpProblem(kind, str(error))
    return problem_of_all(kind, error.problems, document)


def problem_of_all(kind: str, problems: Sequence[Problem], document: object) -> HttpProblem:
    """Return the problem that lists the first faults of the body `document`."""
    details = [
        ProblemDetailAnswer(pointer=of_path(problem.path, document), detail=problem.message)
        for problem in problems[:MOST_ERRORS]
    ]
    return HttpProblem(kind, summary(details, len(problems)), errors=details)


def problem_of_shape(error: ValidationError, document: object, model: type[BaseModel]) -> HttpProblem:
    """Return the problem for pydantic's errors in the body `document`, which should be of a model."""
    found = error.errors(include_url=False)
    details = [
        ProblemDetailAnswer(pointer=of_location(_place(one), document), detail=_told(one, model))
        for one in found[:MOST_ERRORS]
    ]
    return HttpProblem("invalid", summary(details, len(found)), errors=details)


_WANTED: Mapping[str, str] = {
    "int_type": "an integer",
    "int_from_float": "an integer",
    "float_type": "a number",
    "string_type": "a text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a mapping of fields",
    "model_type": "a mapping of fields",
}
"""What a field should have been, by the type of pydantic's error."""


def _told(error: ErrorDetails, model: type[BaseModel]) -> str:
    """Return the message of a pydantic error, as for the same fault in a file or an option."""
    if error["type"] == "extra_forbidden":
        *where, field = error["loc"]
        known = fields_at(model, where)
        if field in known:  # of another variant: a situation beside a map state
            return "must not be given beside the other fields here"
        return f"unknown field{suggestion(str(field), known)}"
    limits, value = error.get("ctx", {}), error["input"]
    if error["type"] == "missing":
        return "missing"
    if error["type"] in _WANTED:
        return f"must be {_WANTED[error['type']]}, got {shown(value)}"
    if error["type"] == "literal_error" and isinstance(value, str):
        return no_option(value, re.findall(r"'([^']*)'", limits["expected"]))
    if error["type"] in ("too_short", "too_long"):
        least = limits.get("min_length")
        wanted = f"at most {limits['max_length']}" if least is None else f"at least {least}"
        return f"must have {wanted} items, has {limits['actual_length']}"
    if not limits.keys() & {"ge", "gt", "le"} or not isinstance(value, int | float):
        return error["msg"]
    least = limits.get("ge", limits.get("gt", -math.inf))
    bound = Bound(least, limits.get("le", math.inf), above="gt" in limits)
    return bound.fault(value) or error["msg"]


def _place(error: ErrorDetails) -> tuple[str | int, ...]:
    """Return the location of a pydantic error; if one of several fields is required, the likeliest of them."""
    if error["type"] == NO_VARIANT:
        return (*error["loc"], error["ctx"]["keys"].split()[0])
    return error["loc"]


_INDEX = re.compile(r"\[(\d+)\]")


def pointer(parts: Sequence[str | int]) -> str:
    """Return the pointer to the value that the keys and indices lead to; empty for the whole body."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)


def of_path(path: str, body: object) -> str:
    """Return the pointer for a library path into `body`; a part that is not there counts as a missing field."""
    parts: list[str | int] = []
    while path:
        part, path = _first(path.removeprefix("."), body)
        parts.append(part)
        body = _at(body, part)
    return pointer(parts)


def of_location(location: Sequence[str | int], body: object) -> str:
    """Return the pointer for a pydantic location, without the tags that distinguish variants."""
    parts: list[str | int] = []
    location = [part for part in location if not str(part).startswith(VARIANT)]
    for i, part in enumerate(location):
        found = _at(body, part)
        is_missing = i == len(location) - 1 and isinstance(body, Mapping) and isinstance(part, str)
        if found is not None or is_missing:
            parts.append(part)
            body = found
    return pointer(parts)


def _first(path: str, body: object) -> tuple[str | int, str]:
    """Split off the first step of a path: the longest key of the body that is a prefix of it."""
    index = _INDEX.match(path)
    if index is not None:
        return int(index[1]), path[index.end() :]
    if isinstance(body, Mapping):
        keys = [key for key in body if isinstance(key, str) and key and path.startswith(key)]
        keys = [key for key in keys if path[len(key) : len(key) + 1] in ("", ".", "[")]
        if keys:
            key = max(keys, key=len)
            return key, path[len(key) :]
    match = re.match(r"[^.\[]*", path)
    word = match[0] if match is not None and match[0] else path
    return word, path[len(word) :]


def _at(body: object, part: str | int) -> Any:
    if isinstance(body, Mapping):
        return body.get(part)
    if isinstance(body, list) and isinstance(part, int) and part < len(body):
        return body[part]
    return None
