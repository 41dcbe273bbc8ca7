"""Jobs or missions in a folder, for tests: opened, asked, closed."""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

from marsupial_service.entries.records import EventRecord
from marsupial_service.entries.service import Entries
from marsupial_service.jobs.service import Jobs
from marsupial_service.missions.service import Missions
from marsupial_service.store import Store, open_store

T = TypeVar("T", Jobs, Missions)


@asynccontextmanager
async def opened(place: Path | str, make: Callable[[Store], T]) -> AsyncIterator[T]:
    """Give what is made of the store of a folder, started; stopped and closed afterwards."""
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
