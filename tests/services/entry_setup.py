"""Open jobs or missions of a store, and follow their events."""

from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from marsupial_service.entries.records import EntrySettings, EventRecord
from marsupial_service.entries.service import Entries
from marsupial_service.jobs.service import Jobs
from marsupial_service.missions.service import Missions
from marsupial_service.settings import ServiceLimits
from marsupial_service.store import Store, open_store

T = TypeVar("T", Jobs, Missions)
S = TypeVar("S", bound=EntrySettings)

_LIMITS = frozenset(one.name for one in fields(ServiceLimits))


class AnyLimits(ServiceLimits):
    """Limits without lower bounds."""

    def __post_init__(self) -> None:
        pass


def settings_of(kind: type[S], **given: Any) -> S:
    """Return settings with given fields and limits, by name."""
    limits = {name: given.pop(name) for name in _LIMITS & given.keys()}
    return kind(limits=AnyLimits(**limits), **given)


@asynccontextmanager
async def opened(place: Path | str, make: Callable[[Store], T]) -> AsyncIterator[T]:
    """Yield the service that `make` builds on a store, started; stop and close both afterwards."""
    store = open_store(place)
    try:
        entries = make(store)
        await entries.start()
        try:
            yield entries
        finally:
            await entries.stop()
    finally:
        store.close()


async def followed(entries: Entries[Any], entry: str, after: int = 0) -> AsyncGenerator[EventRecord]:
    """Yield the events of an entry after number `after`, one after the other, until its last one."""
    async for events in entries.follow(entry, after):
        for event in events:
            yield event
