"""Processors that Ray has reserved for runs of one gateway (placement groups).

Ray looks again for room about once a second where there was none. So the processors of a finished run go to the next
run of the same gateway, if one waits for as many or arrives at once, and otherwise back to Ray.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Collection, Coroutine
from typing import Any, NamedTuple

_LOOK_S = 1.0
_KEPT_S = 0.2
_AT_A_TIME = 64
_NODE = "ray.io/node-id"


class NodePlace(NamedTuple):
    """A number of processors of a node, and the reservation (None: of no processors)."""

    cpus: float
    node: str
    group: Any = None


class Places:
    """The reservations of a gateway: `call` calls a blocking function of Ray in a thread, `go` starts a coroutine."""

    def __init__(
        self, call: Callable[..., Coroutine[Any, Any, Any]], go: Callable[[Coroutine[Any, Any, Any]], None]
    ) -> None:
        self._call = call
        self._go = go
        self._asking = asyncio.Semaphore(_AT_A_TIME)
        self._waiting: dict[float, deque[asyncio.Future[NodePlace]]] = {}
        self._left: dict[float, deque[NodePlace]] = {}

    async def find(self, cpus: float, nodes: Collection[str], still: Callable[[], bool]) -> NodePlace | None:
        """Return a place on one of these nodes; None once `still` says that it is no longer wanted."""
        left = self._left.get(cpus)
        while left:
            place = left.popleft()
            if place.node in nodes:
                return place
            self.give_back(place)
        async with self._asking:
            group = await self._call(_reserve, cpus, sorted(nodes))
            offered: asyncio.Future[NodePlace] = asyncio.get_running_loop().create_future()
            self._waiting.setdefault(cpus, deque()).append(offered)
            try:
                node = await self._either(group, offered, still)
            finally:
                if not offered.done():
                    self._waiting[cpus].remove(offered)
        own = NodePlace(cpus, node or "", group)
        if node is None:
            self.give_back(own)
            return offered.result() if offered.done() else None
        if offered.done():
            self.offer(offered.result())
        return own

    async def _either(self, group: Any, offered: asyncio.Future[NodePlace], still: Callable[[], bool]) -> str | None:
        """Return where processors are reserved; None if they are no longer needed."""
        while still() and not offered.done():
            looking = asyncio.ensure_future(self._call(_node_of, group))
            await asyncio.wait((looking, offered), return_when=asyncio.FIRST_COMPLETED)
            if looking.done() and (node := looking.result()) is not None:
                return node
        return None

    def offer(self, place: NodePlace) -> None:
        """Offer a place that is no longer needed to another run."""
        if place.group is None:
            return
        waiting = self._waiting.get(place.cpus)
        if waiting:
            waiting.popleft().set_result(place)
            return
        self._left.setdefault(place.cpus, deque()).append(place)
        asyncio.get_running_loop().call_later(_KEPT_S, self._tidy, place)

    def _tidy(self, place: NodePlace) -> None:
        if place in self._left[place.cpus]:
            self._left[place.cpus].remove(place)
            self.give_back(place)

    def give_back(self, place: NodePlace) -> None:
        """Return a place to Ray."""
        if place.group is not None:
            self._go(self._call(_give_back, place.group))


def _reserve(cpus: float, nodes: list[str]) -> Any:
    from ray.util.placement_group import placement_group

    return placement_group([{"CPU": cpus}], bundle_label_selector=[{_NODE: f"in({','.join(nodes)})"}])


def _node_of(group: Any) -> str | None:
    """Return where processors are reserved, None if they are not within a moment."""
    from ray.util.placement_group import placement_group_table

    if not group.wait(_LOOK_S):
        return None
    node: str | None = placement_group_table(group)["bundles_to_node_id"].get(0)
    return node


def _give_back(group: Any) -> None:
    from ray.util.placement_group import remove_placement_group

    remove_placement_group(group)
