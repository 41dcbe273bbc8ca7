"""How many plannings go on at a time in one server: those of jobs, and those of missions, whose robots are waiting.

A mission's planning comes before any job. Where all slots are taken the newest job is broken off for it: the job goes
back into the queue with its best plan, and with as much of its budget as is left. Missions of several owners are served
in turn.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Place:
    """A slot that is taken.

    Attributes
    ----------
    breaks
        Ends what has it, if that can be broken off; see `Slots.let_break`.
    is_wanted
        Whether it is broken off, so that a mission gets the slot.
    """

    def __init__(self) -> None:
        self.breaks: Callable[[], None] | None = None
        self.is_wanted = False


class Slots:
    """The slots of one server, in one event loop."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._taken: list[Place] = []
        self._missions: OrderedDict[str, deque[asyncio.Future[Place]]] = OrderedDict()
        self._jobs: deque[asyncio.Future[Place]] = deque()

    @property
    def in_use(self) -> int:
        """How many are taken."""
        return len(self._taken)

    async def for_job(self) -> Place:
        """Take a slot for a job as soon as one is free that no mission waits for."""
        return await self._wait(self._jobs)

    async def for_mission(self, owner: str) -> Place:
        """Take a slot for a mission; if none is free a job is broken off."""
        if len(self._taken) >= self.count:
            self._break_off()
        return await self._wait(self._missions.setdefault(owner, deque()))

    def let_break(self, place: Place, breaks: Callable[[], None]) -> None:
        """Let what has a slot be broken off from now on: at once, if a mission waits for which nothing is."""
        place.breaks = breaks
        waiting = sum(not turn.done() for queue in self._missions.values() for turn in queue)
        if waiting > sum(one.is_wanted for one in self._taken):
            self._break_off()

    def free(self, place: Place) -> None:
        """Give a slot back."""
        self._taken.remove(place)
        self._hand_out()

    @contextmanager
    def taken(self, place: Place) -> Iterator[Place]:
        """Give a slot back at the end."""
        try:
            yield place
        finally:
            self.free(place)

    async def _wait(self, queue: deque[asyncio.Future[Place]]) -> Place:
        turn: asyncio.Future[Place] = asyncio.get_running_loop().create_future()
        queue.append(turn)
        self._hand_out()
        try:
            return await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self.free(turn.result())
            raise

    def _hand_out(self) -> None:
        while len(self._taken) < self.count and (turn := self._next()) is not None:
            place = Place()
            self._taken.append(place)
            turn.set_result(place)

    def _next(self) -> asyncio.Future[Place] | None:
        """Return whose turn it is, of those that still wait."""
        while self._missions:
            owner, queue = self._missions.popitem(last=False)
            turn = _first(queue)
            if queue:
                self._missions[owner] = queue  # behind the others
            if turn is not None:
                return turn
        return _first(self._jobs)

    def _break_off(self) -> None:
        for place in reversed(self._taken):
            if place.breaks is not None:
                breaks, place.breaks = place.breaks, None
                place.is_wanted = True
                breaks()
                return


def _first(queue: deque[asyncio.Future[Place]]) -> asyncio.Future[Place] | None:
    while queue:
        turn = queue.popleft()
        if not turn.done():
            return turn
    return None
