"""The size of a mission in the store, before and after its removal."""

import asyncio
from pathlib import Path

import pytest
from mission_setup import Driver, add_mission, open_missions, started, team

from marsupial_service.entries import table as entry_table
from marsupial_service.entries.capacity import stored_bytes
from marsupial_service.missions.table import MISSIONS
from marsupial_service.operations import upkeep
from marsupial_service.store import Store, open_store
from marsupial_service.store.sqlite import FILE


async def test_a_report_with_all_that_follows_from_it_takes_well_under_a_kilobyte(place: str) -> None:
    async with open_missions(place) as missions:
        record = await started(missions)
        driver = Driver(team())
        assert await driver.drive(missions, record)
        stored, reports = await missions.read(stored_bytes), len(driver.reports)
    assert reports > 30
    assert stored / reports < 700


@pytest.mark.parametrize("by_age", [True, False])
async def test_a_store_shrinks_to_what_is_live_when_missions_are_removed(tmp_path: Path, by_age: bool) -> None:
    store = open_store(tmp_path)
    for i in range(12):
        store.write(lambda tx, i=i: add_mission(tx, f"m{i}", "me", 700, 100 * (i % 4))).result()
    store.checkpoint()
    full = (tmp_path / FILE).stat().st_size
    store.close()
    kept = {"retention_s": 0.25, "kept_missions": 99} if by_age else {"retention_s": 99.0, "kept_missions": 3}
    async with open_missions(tmp_path, **kept) as missions:
        missions.now_ms = lambda: 500
        while is_sweeping(tmp_path, len(await missions.list("me"))):
            await asyncio.sleep(0.05)
    size = upkeep.info(tmp_path).disk_bytes
    assert upkeep.info(tmp_path).rows["mission_events"] == 3 * 700
    assert size < full / 2
    assert size <= 1.2 * upkeep.live_bytes(tmp_path)


def is_sweeping(folder: Path, missions: int) -> bool:
    """Return whether rows, free pages or the write-ahead log still wait for cleanup."""
    found = upkeep.info(folder)
    return missions > 3 or found.free_bytes > found.disk_bytes / 50 or found.disk_bytes > (folder / FILE).stat().st_size


@pytest.fixture
def long(place: str, monkeypatch: pytest.MonkeyPatch) -> Store:
    monkeypatch.setattr(entry_table, "_MOST_ROWS", 1000)
    store = open_store(place)
    store.write(lambda tx: add_mission(tx, "long", "me", 600, 100)).result()
    store.write(lambda tx: add_mission(tx, "short", "me", 3, 200)).result()
    return store


def test_a_long_mission_is_removed_in_steps_and_is_hidden_meanwhile(long: Store) -> None:
    told: list[str] = []
    long.listen(lambda topics: told.extend(topics or ()))
    assert long.write(lambda tx: MISSIONS.remove_old(tx, 0.0, 10_000, 101)).result() == 1
    assert told == ["long"]
    assert long.read(lambda c: MISSIONS.find(c, "long")).result() is None
    assert [record.id for record in long.read(lambda c: MISSIONS.newest(c, "me", 9)).result()] == ["short"]
    assert long.read(lambda c: MISSIONS.events(c, "long", 0, 9)).result().events == ()
    count = "SELECT count(*) FROM mission_events"
    left = long.read(lambda c: c.execute(count).fetchone()[0]).result()
    assert 0 < left - 3 < 600
    assert long.write(lambda tx: MISSIONS.remove_old(tx, 0.0, 10_000, 101)).result() == 1
    assert long.write(lambda tx: MISSIONS.remove_old(tx, 0.0, 10_000, 101)).result() == 0
    assert long.read(lambda c: c.execute(count).fetchone()[0]).result() == 3
    assert long.read(lambda c: c.execute("SELECT count(*) FROM missions").fetchone()[0]).result() == 1
    long.close()
