"""What it takes to continue a long mission after its process or server has died."""

import asyncio
import sqlite3
import threading
from contextlib import closing
from pathlib import Path

import pytest
from mission_setup import Driver, add_mission, open_missions, started, team

from marsupial_service.missions import packed, state
from marsupial_service.missions.table import MISSIONS
from marsupial_service.missions.values import Input
from marsupial_service.store import open_store
from marsupial_service.store.sqlite import FILE


def test_reading_a_stored_batch_takes_no_longer_in_a_long_mission(tmp_path: Path) -> None:
    steps = {}
    for reports in (100, 2000):
        folder = tmp_path / str(reports)
        store = open_store(folder)
        store.write(lambda tx, reports=reports: add_mission(tx, "m", "me", reports, 0)).result()
        store.close()
        with closing(sqlite3.connect(folder / FILE)) as connection:
            connection.row_factory = sqlite3.Row
            number, counted = MISSIONS.existing(connection, "m").number, [0]
            connection.set_progress_handler(lambda counted=counted: counted.append(0), 1)
            assert len(list(packed.events_of(connection, number, 90, 90))) == 3
            assert len(list(packed.batches_of(connection, number, 90, 94))) == 5
            steps[reports] = len(counted)
    assert steps[2000] < 1.1 * steps[100]


async def test_what_is_stored_of_a_mission_is_never_applied_in_the_thread_that_writes(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver, threads, decode = Driver(team()), [], state.decode_input
    async with open_missions(place) as missions:
        record = await started(missions)
        assert not await driver.drive(missions, record, 9)

    def decoded(text: bytes) -> Input:
        threads.append(threading.current_thread().name)
        return decode(text)

    monkeypatch.setattr(state, "decode_input", decoded)
    monkeypatch.setattr(state, "_AT_A_TIME", 4)
    async with open_missions(place) as missions:
        shown = await asyncio.gather(*(missions.last_reports(record) for _ in range(3)))
        assert [one.n for one in shown] == 3 * [9]
        assert await driver.drive(missions, record)
    assert len(threads) >= 9
    assert not [name for name in threads if name.startswith("store-writer")]
