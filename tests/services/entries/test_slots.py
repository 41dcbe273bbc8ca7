import asyncio

import pytest
from support.waiting import HANG_S

from marsupial_service.entries.slots import Slot, Slots


async def test_missions_come_before_jobs_and_owners_alternate() -> None:
    slots, order = Slots(1), list[str]()
    first = await slots.for_job()

    async def take(name: str, owner: str | None) -> None:
        waiting = slots.for_job() if owner is None else slots.for_owner(owner)
        with slots.holding(await waiting):
            order.append(name)

    wanted = (("job", None), ("a1", "a"), ("a2", "a"), ("a3", "a"), ("b1", "b"))
    tasks = [asyncio.create_task(take(*one)) for one in wanted]
    await asyncio.sleep(0)
    slots.free(first)
    await asyncio.gather(*tasks)
    assert slots.in_use == 0
    assert order == ["a1", "b1", "a2", "a3", "job"]


async def test_an_owner_without_a_slot_precedes_those_with_slots() -> None:
    slots, order = Slots(3), list[str]()
    held = [await slots.for_owner("a") for _ in range(3)]

    async def take(owner: str) -> None:
        await slots.for_owner(owner)
        order.append(owner)

    waiting = [asyncio.create_task(take(owner)) for owner in ("a", "a", "b", "c")]
    await asyncio.sleep(0)
    assert (slots.waiting("a"), slots.waiting("b"), slots.waiting("d")) == (2, 1, 0)
    for place in held[:2]:
        slots.free(place)
    await asyncio.sleep(0)
    for task in waiting:
        task.cancel()
    assert order == ["b", "c"]


async def test_an_owner_leaves_slots_to_others_where_it_may_not_hold_all() -> None:
    slots = Slots(3, per_owner=2)
    held = [await slots.for_owner("a") for _ in range(2)]
    third = asyncio.create_task(slots.for_owner("a"))
    async with asyncio.timeout(HANG_S):
        await slots.for_owner("b")
    assert (slots.in_use, third.done()) == (3, False)
    slots.free(held[0])
    async with asyncio.timeout(HANG_S):
        await third


async def test_the_newest_job_is_preempted_for_a_mission_once() -> None:
    slots, broken = Slots(2), list[str]()

    def job(place: Slot, name: str) -> None:
        def breaks() -> None:
            broken.append(name)
            slots.free(place)

        place.preempt = breaks

    for name in ("old", "new"):
        job(await slots.for_job(), name)
    mission = await slots.for_owner("a")
    slots.free(mission)
    await slots.for_owner("a")
    assert broken == ["new"]
    await slots.for_owner("a")
    assert broken == ["new", "old"]


async def test_a_job_that_can_be_preempted_only_later_is_preempted_and_no_other() -> None:
    slots, broken = Slots(2), list[str]()
    old, new = await slots.for_job(), await slots.for_job()
    mission = asyncio.create_task(slots.for_owner("a"))
    await asyncio.sleep(0)
    slots.allow_preemption(new, lambda: broken.append("new"))
    slots.allow_preemption(old, lambda: broken.append("old"))
    slots.free(new)
    async with asyncio.timeout(HANG_S):
        await mission
    assert broken == ["new"]


@pytest.mark.parametrize("moment", ["waiting", "given"])
def test_a_cancelled_waiter_takes_no_slot(moment: str) -> None:
    async def plan() -> None:
        slots = Slots(1)
        first = await slots.for_job()
        gone = asyncio.create_task(slots.for_owner("a"))
        await asyncio.sleep(0)
        if moment == "given":
            slots.free(first)
        gone.cancel()
        with pytest.raises(asyncio.CancelledError):
            await gone
        if moment == "waiting":
            slots.free(first)
        assert slots.in_use == 0
        async with asyncio.timeout(HANG_S):
            await slots.for_job()

    asyncio.run(plan())
