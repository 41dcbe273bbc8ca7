"""What passes between entries and those who ask for them: records, events, settings, refusals."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic, NamedTuple, TypeVar

from marsupial_service.settings import ServiceLimits


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredEntry:
    """A job or mission as it is stored; it is dated `finished_at_ms` if and only if its state is final."""

    number: int
    id: str
    owner: str
    state: StrEnum
    created_at_ms: int
    finished_at_ms: int | None


E = TypeVar("E", bound=StoredEntry)


@dataclass(frozen=True, slots=True, kw_only=True)
class NewEntry:
    """An entry to be stored; two requests with one idempotency `key` must have the same `digest` of what was sent."""

    id: str
    owner: str
    key: str | None
    digest: bytes


class Created(NamedTuple, Generic[E]):
    """An acknowledged entry; `replayed` if an earlier request with the same key had made it."""

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
    """The next events of an entry, and whether more may come after the last one there is."""

    events: tuple[EventRecord, ...] = ()
    is_open: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class EntrySettings:
    """The limits that hold for entries, and callbacks: for each planning, and each background task that fails."""

    limits: ServiceLimits = field(default_factory=ServiceLimits)
    planned: Callable[[str, float], None] = lambda owner, seconds: None
    failed: Callable[[str], None] = lambda task: None


class KeyReused(Exception):
    """An idempotency key came again with another request."""


class TooMany(Exception):
    """No more is taken at the moment; worth another try after `retry_after_s` seconds."""

    def __init__(self, said: str, retry_after_s: int = 1) -> None:
        super().__init__(said)
        self.retry_after_s = retry_after_s


class UnknownEntry(Exception):
    """There is no such entry, no longer, or it belongs to another owner."""

    def __init__(self, noun: str) -> None:
        super().__init__(f"there is no such {noun}, or no longer")


def digest_of(document: object) -> bytes:
    """Return what tells a document apart from others: the same for all that say the same."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).digest()
