"""Who waits for news of which entry: bells that ring in the event loop when something was committed."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from marsupial_service.store import Store


class Bells:
    """The bells of one event loop; `ring` and `bell` are for that loop only."""

    def __init__(self) -> None:
        self._bells: dict[str, set[asyncio.Event]] = {}

    @contextmanager
    def bell(self, topic: str) -> Iterator[asyncio.Event]:
        """Give an event that is set whenever there is news on `topic`; a waiting caller clears it before looking."""
        event = asyncio.Event()
        self._bells.setdefault(topic, set()).add(event)
        try:
            yield event
        finally:
            bells = self._bells[topic]
            bells.discard(event)
            if not bells:
                del self._bells[topic]

    def attend(self, store: Store) -> None:
        """Ring for whatever is committed from now on; called in the event loop."""
        loop = asyncio.get_running_loop()

        def pass_on(topics: frozenset[str] | None) -> None:  # in any thread, also after the loop has ended
            with suppress(RuntimeError):
                loop.call_soon_threadsafe(*((self.ring_all,) if topics is None else (self.ring, topics)))

        store.listen(pass_on)

    def ring(self, topics: frozenset[str]) -> None:
        """Ring the bells of these topics."""
        for topic in topics:
            for event in self._bells.get(topic, ()):
                event.set()

    def ring_all(self) -> None:
        """Ring every bell."""
        self.ring(frozenset(self._bells))
