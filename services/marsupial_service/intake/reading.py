"""From the bytes of a body to the value that a route wants: parsed, counted, validated, made.

The server's process reads small bodies itself. It has a large body, or a small one with a large map, read in a separate
process with limits: meanwhile the server answers other requests, and the memory that the body takes is freed with that
process.
"""

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, NoReturn, TypeVar

from pydantic import BaseModel, ValidationError

from marsupial.errors import MarsupialError
from marsupial.formats.jsonvalues import JsonFault, load_json
from marsupial_service.entries.records import canonical_text, digest_of
from marsupial_service.intake.counts import Count, check_counts, counts_of
from marsupial_service.intake.supervised import RequestProcesses
from marsupial_service.problems import HttpProblem, problem_of, problem_of_shape
from marsupial_service.settings import ServiceLimits

# of a body that is read in the server's process: 5 ms at most. Another process costs about as much as 200 kB
INLINE_BYTES = 65_536
# of an image that is decoded there
INLINE_CELLS = 250_000
# of a body whose value is made there at once, if that is quick: it takes 1 ms at most
QUICK_BYTES = 8192

B = TypeVar("B", bound=BaseModel)
T = TypeVar("T")


class ReceivedBody(NamedTuple):
    """A received body and its sender."""

    data: bytes
    owner: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyReader(Generic[B, T]):
    """How bodies of one kind are read. It is sent to other processes: all functions are of a module's top level.

    `make` gets the body, the digest of what was sent, the limits and what `read` was given besides. It raises
    MarsupialError or HttpProblem.
    """

    model: type[B]
    make: Callable[..., T]
    cells: Callable[[B], int] | None = None  # of images that have to be decoded for it
    is_quick: Callable[[B], bool] | None = None  # whether making it takes as little as its bytes are few
    needs_quota: bool = False  # to be read by a process: what is stored asks for quota when it is stored
    counts: tuple[Count, ...] = field(init=False)  # checked before the body is validated

    def __post_init__(self) -> None:
        object.__setattr__(self, "counts", counts_of(self.model))


class ParsedBody(NamedTuple):
    """A parsed body, and its canonical text."""

    document: Any
    text: bytes

    @property
    def digest(self) -> bytes:
        """The digest of the body; requests with one idempotency key must have the same."""
        return digest_of(self.text)


async def read(
    readers: RequestProcesses, limits: ServiceLimits, sent: ReceivedBody, reader: BodyReader[B, T], *more: Any
) -> T:
    """Return the value of a body; a large one is read by `readers`. Raises HttpProblem."""
    if len(sent.data) <= INLINE_BYTES:
        document = parse(sent.data)
        body = _validated(document, reader, limits)
        if len(sent.data) <= QUICK_BYTES and reader.is_quick is not None and reader.is_quick(body):
            return _converted(document, body, reader, limits, more)
        if reader.cells is None or reader.cells(body) <= INLINE_CELLS:
            return await asyncio.to_thread(_converted, document, body, reader, limits, more)
    return await readers.value_of(
        sent.owner, read_in_process, (sent.data, reader, limits, more), needs_quota=reader.needs_quota
    )


def read_in_process(job: tuple[bytes, BodyReader[B, T], ServiceLimits, tuple[Any, ...]]) -> T:
    """Return the value of a body. Raises HttpProblem."""
    data, reader, limits, more = job
    document = parse(data)
    return _converted(document, _validated(document, reader, limits), reader, limits, more)


def _validated(document: Any, reader: BodyReader[B, T], limits: ServiceLimits) -> B:
    check_counts(document, reader.counts, limits)
    try:
        return reader.model.model_validate(document)
    except ValidationError as error:
        raise problem_of_shape(error, document, reader.model) from None


def _converted(document: Any, body: B, reader: BodyReader[B, T], limits: ServiceLimits, more: tuple[Any, ...]) -> T:
    try:
        return reader.make(body, ParsedBody(document, canonical_text(document)), limits, *more)
    except MarsupialError as error:
        raise problem_of(error, document) from None


# the first that fits: the errors of UTF-8 are ValueErrors too
_REASONS = {
    UnicodeDecodeError: "is not UTF-8 text",
    UnicodeEncodeError: "a string contains half of a surrogate pair",
    RecursionError: "is nested too deeply",
    ValueError: "a number has too many digits",
}


def parse(data: bytes) -> Any:
    """Return the value that strict JSON text describes. Raises HttpProblem if it is no such text.

    It is UTF-8 with no field twice, no NaN, no half of a surrogate pair, nothing endless. JSON has one kind of number:
    ``1.0`` and ``1e0`` are read as ``1`` is, so that requests that differ in nothing else are the same request.
    """
    try:
        value = load_json(data.decode("utf-8"), parse_constant=_no_constant, parse_float=_number)
        # half of a surrogate pair can only come from an escape
        if b"\\u" in data:
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except JsonFault as fault:
        raise HttpProblem("bad-json", str(fault)) from None
    except json.JSONDecodeError as error:
        raise HttpProblem("bad-json", f"line {error.lineno}, column {error.colno}: {error.msg}") from None
    except (ValueError, RecursionError) as error:
        reason = next(text for kind, text in _REASONS.items() if isinstance(error, kind))
        raise HttpProblem("bad-json", reason) from None
    return value


def _number(text: str) -> float:
    value = float(text)
    return int(value) if value.is_integer() else value


def _no_constant(word: str) -> NoReturn:
    raise HttpProblem("bad-json", f"{word} is not a JSON number")
