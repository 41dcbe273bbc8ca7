"""Released placements go to waiting runs. Ray is a fake whose functions answer on command."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from support.waiting import wait_until_async

from marsupial.cluster.placements import Placement, PlacementPool


class Ray:
    """A cluster of one node, which grants a reservation once `free` is set."""

    def __init__(self) -> None:
        self.free = asyncio.Event()
        self.made = 0
        self.given_back: list[Any] = []
        self._tasks: set[asyncio.Task[Any]] = set()

    async def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        if function.__name__ == "_create_group":
            self.made += 1
            return self.made
        if function.__name__ == "_node_of":
            await self.free.wait()
            return "node"
        self.given_back.append(arguments[0])
        return None

    def go(self, work: Coroutine[Any, Any, Any]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)


async def test_a_place_that_is_left_goes_to_who_waits_and_its_own_reservation_back() -> None:
    ray = Ray()
    places = PlacementPool(ray.call, ray.go)
    waiting = asyncio.create_task(places.find(1.0, {"node"}, lambda: True))
    await asyncio.sleep(0.01)
    left = Placement(1.0, "node", "left")
    places.release(left)
    assert await waiting == left
    await asyncio.sleep(0.01)
    assert ray.given_back == [1]


async def test_an_unused_reservation_is_released_soon_and_one_on_another_node_at_once() -> None:
    ray = Ray()
    ray.free.set()
    places = PlacementPool(ray.call, ray.go)
    places.release(Placement(1.0, "lost", "old"))
    assert await places.find(1.0, {"node"}, lambda: True) == Placement(1.0, "node", 1)
    places.release(Placement(1.0, "node", "kept"))
    assert await places.find(0.5, {"node"}, lambda: True) == Placement(0.5, "node", 2)
    assert await places.find(1.0, {"node"}, lambda: True) == Placement(1.0, "node", "kept")
    places.release(Placement(1.0, "node", "unwanted"))
    await wait_until_async(lambda: "unwanted" in ray.given_back)
    assert ray.given_back == ["old", "unwanted"]


async def test_a_cancelled_waiter_leaves_no_reservation() -> None:
    class Full(Ray):
        async def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
            return None if function.__name__ == "_node_of" else await super().call(function, *arguments)

    ray = Full()
    places = PlacementPool(ray.call, ray.go)
    wanted = iter([True, True, False])
    assert await places.find(1.0, {"node"}, lambda: next(wanted)) is None
    await asyncio.sleep(0.01)
    assert ray.given_back == [1]
    places.release(Placement(1.0, "node", "left"))
    assert await places.find(1.0, {"node"}, lambda: True) == Placement(1.0, "node", "left")
