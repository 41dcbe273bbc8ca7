"""Missions of several servers on one database: every server answers, one owns a mission."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager

from mission_setup import Driver, open_missions, started, team
from support.missions.reference_missions import reference_log

from marsupial_service.missions import table
from marsupial_service.missions.records import MissionRecord, MissionSettings
from marsupial_service.missions.service import Missions
from marsupial_service.store import open_store


@asynccontextmanager
async def two(shared: str) -> AsyncIterator[tuple[Missions, Missions]]:
    async with AsyncExitStack() as stack:
        first, second = [await stack.enter_async_context(open_missions(shared)) for _ in range(2)]
        yield first, second


class Both(Missions):
    """A client behind a proxy that alternates between servers."""

    def __init__(self, *servers: Missions) -> None:
        self._servers = servers
        self._turn = 0

    def __getattribute__(self, name: str) -> object:
        if name.startswith("_"):
            return object.__getattribute__(self, name)
        self._turn += 1
        return getattr(self._servers[self._turn % len(self._servers)], name)


async def test_a_mission_reported_to_alternating_servers_has_the_same_log(shared: str) -> None:
    async with two(shared) as servers:
        record = await started(servers[0])
        driver = Driver(team())
        assert not await driver.drive(Both(*servers), record, 4)
        assert not await driver.drive(servers[1], record, 8)
        assert await driver.drive(Both(*servers), record)
        assert await servers[1].log(record) == reference_log("lobby")


async def test_a_server_that_counts_as_dead_changes_nothing_of_its_missions(shared: str) -> None:
    async with two(shared) as (first, second):
        record = await started(first)
        driver = Driver(team())
        assert not await driver.drive(first, record, 4)
        held = await first.of("me", record.id)

        taken = await second.write(lambda tx: _take_over(tx, held))
        assert taken.term == held.term + 1
        assert not await first.write(lambda tx: table.current_in_term(tx, record.id, held.term) is not None)

        again = taken
        while again.term == taken.term:  # the mission is skipped while the first server still tries to write
            await second._recover()  # it still runs a process whose results are discarded
            again = await second.of("me", record.id)
        assert again.term == held.term + 2
        assert await driver.drive(second, record)


def _take_over(tx: object, record: MissionRecord) -> MissionRecord:
    table.MISSIONS.take_over(tx, record.number)  # type: ignore[arg-type]
    return table.MISSIONS.existing(tx, record.id)  # type: ignore[arg-type]


async def test_another_server_takes_over_from_a_killed_one(shared: str) -> None:
    async with open_missions(shared) as second:
        store = open_store(shared)
        first = Missions(store, MissionSettings())
        await first.start()
        record = await started(first)
        driver = Driver(team())
        assert not await driver.drive(first, record, 6)
        for task in first.background.running:  # its process ends
            task.cancel()
        store._engine._ended.set()  # type: ignore[attr-defined]
        await second.write(lambda tx: tx.execute("DELETE FROM servers WHERE id = ?", (store._engine.server,)))
        assert await driver.drive(second, record)
        await asyncio.to_thread(store.close)
