"""The values that entries exchange with their callers: records, events, settings, refusals."""

import hashlib
import json
import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic, NamedTuple, TypeVar

from marsupial_service.settings import ServiceLimits
from marsupial_service.timestamps import wall_clock_ms


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredEntry:
    """A stored job or mission; it has a `finished_at_ms` if and only if its state is final."""

    number: int
    id: str
    owner: str
    state: StrEnum
    created_at_ms: int
    finished_at_ms: int | None


E = TypeVar("E", bound=StoredEntry)


@dataclass(frozen=True, slots=True, kw_only=True)
class NewEntry:
    """An entry to store; two requests with the same idempotency `key` must have the same `digest` of their bodies."""

    id: str = field(default_factory=lambda: uuid.uuid4().hex)
    owner: str
    key: str | None
    digest: bytes


class Created(NamedTuple, Generic[E]):
    """An acknowledged entry; `replayed` if an earlier request with the same key created it."""

    record: E
    replayed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class EventRecord:
    """An event of an entry: `seq` counts from 1, `data` is one line of JSON."""

    seq: int
    type: StrEnum
    data: str


@dataclass(frozen=True, slots=True, kw_only=True)
class EventBatch:
    """The next events of an entry, and whether more may follow the entry's last stored event."""

    events: tuple[EventRecord, ...] = ()
    is_open: bool = False
    stored: int = 0  # events of the entry so far, which is the number of the last one


@dataclass(frozen=True, slots=True, kw_only=True)
class EntrySettings:
    """The limits of entries, the clock, and callbacks, which get each planning and each failed background task."""

    limits: ServiceLimits = field(default_factory=ServiceLimits)
    now_ms: Callable[[], int] = wall_clock_ms
    planned: Callable[[str, float], None] = lambda owner, seconds: None
    failed: Callable[[str], None] = lambda task: None


class KeyReused(Exception):
    """An idempotency key was reused with a different request."""


def is_replayed(earlier: bytes | None, digest: bytes | None) -> bool:
    """Return whether a request with an idempotency key repeats an earlier one with that key; None: there was none.

    Both are given by their digests. Raises KeyReused if they differ.
    """
    if earlier is None:
        return False
    if earlier != digest:
        raise KeyReused("the idempotency key was used for another request")
    return True


class TooMany(Exception):
    """No more is accepted at the moment; a retry may succeed after `retry_after_s` seconds."""

    def __init__(self, text: str, retry_after_s: int = 1) -> None:
        super().__init__(text)
        self.retry_after_s = retry_after_s


class UnknownEntry(Exception):
    """The entry doesn't exist, was removed, or belongs to another owner."""

    def __init__(self, noun: str) -> None:
        super().__init__(f"{noun} not found; it may have been removed")


def canonical_text(document: object) -> bytes:
    """Return a document as JSON text: equal for documents with equal content."""
    return json.dumps(document, sort_keys=True).encode()


def digest_of(text: bytes) -> bytes:
    """Return the digest of a document, given its canonical text."""
    return hashlib.sha256(text).digest()
