"""The size limits of a store."""

from __future__ import annotations

import math

import pytest
from mission_setup import Driver, brief, open_missions, started, team

from marsupial_service.entries.capacity import RESERVE, StoreCapacity, StoreFull, stored_bytes
from marsupial_service.entries.table import StoreReader


class Held:
    """A fake connection to a store of `count` bytes, half of them mine."""

    def __init__(self, count: int) -> None:
        self.bytes = count

    def execute(self, sql: str, values: tuple[object, ...] = (), /) -> Held:
        assert values in ((None, None), ("me", "me"))
        return self if values[0] is None else Held(self.bytes // 2)

    def fetchone(self) -> dict[str, int]:
        return {"bytes": self.bytes}


def refuses(capacity: StoreCapacity, reader: StoreReader, *, of_reports: bool) -> bool:
    try:
        capacity.check(reader, "me", of_reports=of_reports)
    except StoreFull:
        return True
    return False


@pytest.mark.parametrize(
    ("stored", "entries", "reports"),
    [(0, False, False), (999, False, False), (1000, True, False), (1099, True, False), (1100, True, True)],
)
def test_reports_are_accepted_beyond_the_limit_of_entries(stored: int, entries: bool, reports: bool) -> None:
    assert RESERVE == 0.1
    held = Held(stored)
    for capacity in (
        StoreCapacity(1000),
        StoreCapacity(key_limit=500),
        StoreCapacity(1000, 9999),
        StoreCapacity(9999, 500),
    ):
        assert [refuses(capacity, held, of_reports=which) for which in (False, True)] == [entries, reports]
    assert not refuses(StoreCapacity(math.inf), held, of_reports=False)


def test_the_message_names_the_full_part() -> None:
    with pytest.raises(StoreFull, match=r"^your part of the store is full: your jobs and missions take 1000 bytes"):
        StoreCapacity(9999, 900).check(Held(2000), "me")


def test_sizes_are_summed_once_a_second() -> None:
    now = [10.0]
    capacity, held = StoreCapacity(1000, clock_s=lambda: now[0]), Held(2000)
    assert refuses(capacity, held, of_reports=True)
    held.bytes = 0
    now[0] += 0.9
    assert refuses(capacity, held, of_reports=True)
    now[0] += 0.2
    assert not refuses(capacity, held, of_reports=True)


async def test_an_open_mission_may_use_the_reserve_and_no_other_starts(place: str) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        driver = Driver(team())
        assert not await driver.drive(missions, record, 5)
        stored = await missions.read(stored_bytes)
        missions._capacity = StoreCapacity(stored)
        with pytest.raises(StoreFull):
            await missions.create(brief(), b"other", owner="me")
        assert not await driver.drive(missions, record, 6)
        missions._capacity = StoreCapacity(stored / (1 + RESERVE))
        with pytest.raises(StoreFull):
            await driver.drive(missions, record)
        missions._capacity = StoreCapacity()
        assert await driver.drive(missions, record)
    assert driver.batch > 7
