"""Jobs where the store is full."""

from __future__ import annotations

import pytest
from job_house import open_jobs, request
from patience import HANG_S

from marsupial_service.entries.capacity import StoreCapacity, StoreFull, stored_bytes


async def test_a_full_store_takes_no_job_but_knows_those_it_has(place: str) -> None:
    async with open_jobs(place) as jobs:
        first = await jobs.submit(request(), owner="me", idempotency_key="k")
        await jobs.wait(first.record.id, HANG_S)
        (mine, other) = [await jobs.read(lambda c, o=owner: stored_bytes(c, o)) for owner in ("me", "you")]
        assert other == 0
        assert 1000 < mine == await jobs.read(stored_bytes) < 20_000
    async with open_jobs(place, store_bytes=mine) as jobs:
        with pytest.raises(StoreFull, match=rf"take {mine} bytes, {mine} are allowed"):
            await jobs.submit(request(), owner="you")
        assert (await jobs.submit(request(), owner="me", idempotency_key="k")).replayed
    async with open_jobs(place, store_bytes=mine, kept_jobs=0) as jobs:
        while await jobs.read(stored_bytes):
            pass
        jobs._capacity = StoreCapacity(mine)
        assert not (await jobs.submit(request(), owner="you")).replayed
