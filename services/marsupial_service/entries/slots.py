"""Limits on concurrent work in one server: plannings of jobs and missions; analyses; parsing of large bodies.

A mission's planning comes before any job. If all slots are taken, it preempts the newest job, which goes back into the
queue with its best plan and the rest of its budget. Waiting owners are served in turn: first the one with the fewest
slots, and among equals the one who has waited longest. Jobs wait in the store's queue, whose turns follow the same
rule (`jobs.turns`).
"""

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Slot:
    """A slot taken by `owner` (None: by a job).

    `breaks` preempts the holder, if that is possible; `is_wanted` if that was done, so that a mission gets the slot.
    """

    def __init__(self, owner: str | None) -> None:
        self.owner = owner
        self.breaks: Callable[[], None] | None = None
        self.is_wanted = False


class Slots:
    """The slots of one server, in one event loop."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._taken: list[Slot] = []
        self._owners: OrderedDict[str, deque[asyncio.Future[Slot]]] = OrderedDict()
        self._jobs: deque[asyncio.Future[Slot]] = deque()

    @property
    def in_use(self) -> int:
        """The number of slots taken."""
        return len(self._taken)

    async def for_job(self) -> Slot:
        """Take a slot for a job as soon as one is free and no owner is waiting."""
        return await self._wait(self._jobs)

    async def for_owner(self, owner: str) -> Slot:
        """Take a slot in turn with other owners, before any job; preempt a job if no slot is free."""
        if len(self._taken) >= self.count:
            self._break_off()
        return await self._wait(self._owners.setdefault(owner, deque()))

    def waiting(self, owner: str) -> int:
        """Return the number of slots that an owner is waiting for."""
        return sum(not turn.done() for turn in self._owners.get(owner, ()))

    def let_break(self, slot: Slot, breaks: Callable[[], None]) -> None:
        """Mark the holder of a slot as preemptible. Preempt it at once if an owner is still waiting."""
        slot.breaks = breaks
        # slots already being preempted will go to waiting owners
        if sum(map(self.waiting, self._owners)) > sum(one.is_wanted for one in self._taken):
            self._break_off()

    def free(self, slot: Slot) -> None:
        """Release a slot."""
        self._taken.remove(slot)
        self._hand_out()

    @contextmanager
    def taken(self, slot: Slot) -> Iterator[Slot]:
        """Release a slot at the end of the block."""
        try:
            yield slot
        finally:
            self.free(slot)

    async def _wait(self, queue: deque[asyncio.Future[Slot]]) -> Slot:
        turn: asyncio.Future[Slot] = asyncio.get_running_loop().create_future()
        queue.append(turn)
        self._hand_out()
        try:
            return await turn
        except asyncio.CancelledError:
            # the slot may have been assigned in the same iteration of the loop: nobody else would release it
            if turn.done() and not turn.cancelled():
                self.free(turn.result())
            raise

    def _hand_out(self) -> None:
        while len(self._taken) < self.count:
            owner, turn = self._next()
            if turn is None:
                return
            slot = Slot(owner)
            self._taken.append(slot)
            turn.set_result(slot)

    def _next(self) -> tuple[str | None, asyncio.Future[Slot] | None]:
        """Return the waiting owner (None: a job) whose turn it is, and the future to resolve (None: nobody waits)."""
        has = Counter(slot.owner for slot in self._taken)
        while self._owners:
            owner = min(self._owners, key=has.__getitem__)
            queue = self._owners.pop(owner)
            turn = _first(queue)
            if queue:
                self._owners[owner] = queue  # behind the others
            if turn is not None:
                return owner, turn
        return None, _first(self._jobs)

    def _break_off(self) -> None:
        for slot in reversed(self._taken):
            if slot.breaks is not None:
                breaks, slot.breaks = slot.breaks, None
                slot.is_wanted = True
                breaks()
                return


def _first(queue: deque[asyncio.Future[Slot]]) -> asyncio.Future[Slot] | None:
    while queue:
        turn = queue.popleft()
        if not turn.done():
            return turn
    return None
