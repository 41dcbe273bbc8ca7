"""Processors that Ray has reserved for runs of one gateway (placement groups).

Ray looks again for room about once a second where there was none. So the processors of a finished run go to the next
run of the same gateway, if one waits for as many or arrives at once, and otherwise back to Ray.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Collection, Coroutine
from typing import Any, NamedTuple

_POLL_S = 1.0
_SPARE_S = 0.2
_MOST_REQUESTS = 64
_NODE = "ray.io/node-id"


class Placement(NamedTuple):
    """A number of processors of a node, and the reservation (None: of no processors)."""

    cpus: float
    node: str
    group: Any = None


class PlacementPool:
    """The reservations of a gateway: `call` calls a blocking function of Ray in a thread, `go` starts a coroutine."""

    def __init__(
        self, call: Callable[..., Coroutine[Any, Any, Any]], go: Callable[[Coroutine[Any, Any, Any]], None]
    ) -> None:
        self._call = call
        self._go = go
        self._requests = asyncio.Semaphore(_MOST_REQUESTS)
        self._waiting: dict[float, deque[asyncio.Future[Placement]]] = {}
        self._spare: dict[float, deque[Placement]] = {}

    async def find(self, cpus: float, nodes: Collection[str], wanted: Callable[[], bool]) -> Placement | None:
        """Return a placement on one of these nodes; None once `wanted` says that it is no longer wanted."""
        left = self._spare.get(cpus)
        while left:
            placement = left.popleft()
            if placement.node in nodes:
                return placement
            self.remove(placement)
        async with self._requests:
            group = await self._call(_create_group, cpus, sorted(nodes))
            offered: asyncio.Future[Placement] = asyncio.get_running_loop().create_future()
            self._waiting.setdefault(cpus, deque()).append(offered)
            try:
                node = await self._wait_for_node(group, offered, wanted)
            finally:
                if not offered.done():
                    self._waiting[cpus].remove(offered)
        own = Placement(cpus, node or "", group)
        if node is None:
            self.remove(own)
            return offered.result() if offered.done() else None
        if offered.done():
            self.release(offered.result())
        return own

    async def _wait_for_node(
        self, group: Any, offered: asyncio.Future[Placement], wanted: Callable[[], bool]
    ) -> str | None:
        """Return where processors are reserved; None if they are no longer needed."""
        while wanted() and not offered.done():
            looking = asyncio.ensure_future(self._call(_node_of, group))
            await asyncio.wait((looking, offered), return_when=asyncio.FIRST_COMPLETED)
            if looking.done() and (node := looking.result()) is not None:
                return node
        return None

    def release(self, placement: Placement) -> None:
        """Offer a placement that is no longer needed to another run."""
        if placement.group is None:
            return
        waiting = self._waiting.get(placement.cpus)
        if waiting:
            waiting.popleft().set_result(placement)
            return
        self._spare.setdefault(placement.cpus, deque()).append(placement)
        asyncio.get_running_loop().call_later(_SPARE_S, self._expire, placement)

    def _expire(self, placement: Placement) -> None:
        if placement in self._spare[placement.cpus]:
            self._spare[placement.cpus].remove(placement)
            self.remove(placement)

    def remove(self, placement: Placement) -> None:
        """Return a placement to Ray."""
        if placement.group is not None:
            self._go(self._call(_remove_group, placement.group))


def _create_group(cpus: float, nodes: list[str]) -> Any:
    from ray.util.placement_group import placement_group

    return placement_group([{"CPU": cpus}], bundle_label_selector=[{_NODE: f"in({','.join(nodes)})"}])


def _node_of(group: Any) -> str | None:
    """Return where processors are reserved, None if they are not within a moment."""
    from ray.util.placement_group import placement_group_table

    if not group.wait(_POLL_S):
        return None
    node: str | None = placement_group_table(group)["bundles_to_node_id"].get(0)
    return node


def _remove_group(group: Any) -> None:
    from ray.util.placement_group import remove_placement_group

    remove_placement_group(group)
