"""Limits on concurrent work in one server: plannings of jobs and missions; analyses; parsing of large bodies.

A mission's planning comes before any job. If all slots are taken, it preempts the newest job, which goes back into the
queue with its best plan and the rest of its budget. Waiting owners are served in turn: first the one with the fewest
slots, and among equals the one who has waited longest. Jobs wait in the store's queue, which follows the same rule
(`jobs.scheduling`).
"""

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Slot:
    """A slot taken by `owner` (None: by a job).

    `preempt` stops the holder, if that is possible; `is_preempted` if that was done, so that a mission gets the slot.
    """

    def __init__(self, owner: str | None) -> None:
        self.owner = owner
        self.preempt: Callable[[], None] | None = None
        self.is_preempted = False


class Slots:
    """The slots of one server, in one event loop; an owner may hold `per_owner` (None: all) of them at a time."""

    def __init__(self, count: int, per_owner: int | None = None) -> None:
        self.count = count
        self._per_owner = count if per_owner is None else per_owner
        self._taken: list[Slot] = []
        self._owners: OrderedDict[str, deque[asyncio.Future[Slot]]] = OrderedDict()
        self._jobs: deque[asyncio.Future[Slot]] = deque()

    @property
    def in_use(self) -> int:
        return len(self._taken)

    async def for_job(self) -> Slot:
        """Take a slot for a job as soon as one is free and no owner is waiting."""
        return await self._wait(self._jobs)

    async def for_owner(self, owner: str) -> Slot:
        """Take a slot in turn with other owners, before any job; preempt a job if no slot is free."""
        if len(self._taken) >= self.count:
            self._preempt()
        return await self._wait(self._owners.setdefault(owner, deque()))

    def waiting(self, owner: str | None = None) -> int:
        """Return the number of slots that an owner, or all of them, are waiting for."""
        queues = self._owners.values() if owner is None else [self._owners.get(owner, deque())]
        return sum(not waiter.done() for queue in queues for waiter in queue)

    def allow_preemption(self, slot: Slot, preempt: Callable[[], None]) -> None:
        """Mark the holder of a slot as preemptible. Preempt it at once if an owner is still waiting."""
        slot.preempt = preempt
        # slots already being preempted will go to waiting owners
        if self.waiting() > sum(one.is_preempted for one in self._taken):
            self._preempt()

    def free(self, slot: Slot) -> None:
        self._taken.remove(slot)
        self._assign()

    @contextmanager
    def holding(self, slot: Slot) -> Iterator[Slot]:
        """Release a slot at the end of the block."""
        try:
            yield slot
        finally:
            self.free(slot)

    async def _wait(self, queue: deque[asyncio.Future[Slot]]) -> Slot:
        waiter: asyncio.Future[Slot] = asyncio.get_running_loop().create_future()
        queue.append(waiter)
        self._assign()
        try:
            return await waiter
        except asyncio.CancelledError:
            # the slot may have been assigned in the same iteration of the loop: nobody else would release it
            if waiter.done() and not waiter.cancelled():
                self.free(waiter.result())
            raise

    def _assign(self) -> None:
        while len(self._taken) < self.count:
            owner, waiter = self._next()
            if waiter is None:
                return
            slot = Slot(owner)
            self._taken.append(slot)
            waiter.set_result(slot)

    def _next(self) -> tuple[str | None, asyncio.Future[Slot] | None]:
        """Return the waiting owner (None: a job) whose turn it is, and the future to resolve (None: nobody waits)."""
        has = Counter(slot.owner for slot in self._taken)
        while self._owners:
            owner = min(self._owners, key=has.__getitem__)
            if has[owner] >= self._per_owner:
                break
            queue = self._owners.pop(owner)
            waiter = _first(queue)
            if queue:
                self._owners[owner] = queue  # behind the others
            if waiter is not None:
                return owner, waiter
        return None, _first(self._jobs)

    def _preempt(self) -> None:
        for slot in reversed(self._taken):
            if slot.preempt is not None:
                preempt, slot.preempt = slot.preempt, None
                slot.is_preempted = True
                preempt()
                return


def _first(queue: deque[asyncio.Future[Slot]]) -> asyncio.Future[Slot] | None:
    while queue:
        waiter = queue.popleft()
        if not waiter.done():
            return waiter
    return None
