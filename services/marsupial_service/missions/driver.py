"""When simulated robots report: at the speed that their mission sets, or at once.

Each batch from the mission's process includes the next report; the supervisor's driver waits until it is due. Each
supervisor has one driver; after a new supervisor takes over, the robots continue from what is stored.
"""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from time import monotonic

from marsupial_service.entries.background import pause
from marsupial_service.entries.capacity import StoreFull
from marsupial_service.entries.records import TooMany
from marsupial_service.missions.values import MissionBatch, StoredReport

# how far the robots may lag behind the clock and still catch up; after a longer planning they continue without hurry
CATCH_UP_S = 0.5
_RETRY_S = 1.0


class MissionClock:
    """Maps mission time to the clock, at `speed` seconds of mission time a second."""

    def __init__(self, speed: float | None) -> None:
        self._ms_per_s = None if speed is None else 1000 * speed
        self._since = (0.0, 0)

    def due_s(self, t_ms: int, now_s: float) -> float:
        """Return the moment on the clock for mission time `t_ms`; the clock shows `now_s`."""
        if self._ms_per_s is None:
            return now_s
        since_s, since_ms = self._since
        due_s = since_s + (t_ms - since_ms) / self._ms_per_s
        if due_s < now_s - CATCH_UP_S:
            self._since = (now_s, t_ms)
            return now_s
        return due_s


class Driver:
    """Makes the robots of one mission report; `take` stores a report, or raises StoreFull or TooMany."""

    def __init__(self, speed: float | None, take: Callable[[StoredReport], Awaitable[None]]) -> None:
        self._clock = MissionClock(speed)
        self._take = take
        self._next: StoredReport | None = None

    def observe(self, batches: Sequence[MissionBatch]) -> None:
        """Remember the report that is due after these batches."""
        for batch in batches:
            self._next = batch.next or self._next

    async def wait(self, news: asyncio.Event) -> None:
        """Wait until there is news or the next report is due; store a due report."""
        if self._next is None:
            await news.wait()
            return
        now_s = monotonic()
        left_s = self._clock.due_s(self._next[0].t_ms, now_s) - now_s
        if left_s > 0:
            await pause(news, left_s)
            if news.is_set():
                return
        try:
            # storing a report twice changes nothing: an earlier supervisor may have stored this one
            await self._take(self._next)
            self._next = None
        except (StoreFull, TooMany):
            await asyncio.sleep(_RETRY_S)
