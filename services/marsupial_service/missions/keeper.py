"""Keeps one mission going: starts its process, hands it the inputs, stores what it makes of them, replaces it.

Whatever process there is gets all inputs from the first one. Turns that are stored must come out again as they are;
the ones after them are new: they are stored, and by that published. A keeper whose turn is not taken, as the mission
has ended or is another server's, is dismissed.
"""

from __future__ import annotations

import asyncio
import logging
from concurrent.futures import Executor, Future

from marsupial.processes import launcher as processes
from marsupial.processes.jobs import Ended, Ending, Job, JobLimits
from marsupial_service.entries.service import Entries
from marsupial_service.entries.slots import Slots
from marsupial_service.missions import table
from marsupial_service.missions.host import fly
from marsupial_service.missions.records import MissionRecord, MissionSettings
from marsupial_service.missions.values import (
    Brief,
    Event,
    EventType,
    HasPlanned,
    Input,
    MayPlan,
    Next,
    Turn,
    WantsToPlan,
)
from marsupial_service.store import StoreError
from marsupial_service.store.engine import Connection

_MOST_DEATHS = 3
"""A process that dies so often by itself before it has made anything new is not started again."""

_MOST_KILLED = 20
"""The same where another process killed it."""

_PAUSE_S = 0.1
_WALL_S = 7 * 86400.0
_LAST_WORDS_S = 0.5
_RETRY_S = 1.0

log = logging.getLogger("marsupial.missions")


class Diverged(Exception):
    """A new process made something else of the same inputs: the mission can't be continued."""


class Dismissed(Exception):
    """The mission has ended, or another server has taken it over."""


class Keeper:
    """Keeps one open mission that this server holds."""

    def __init__(
        self,
        record: MissionRecord,
        brief: Brief,
        missions: Entries[MissionRecord],
        slots: Slots,
        threads: Executor,
        settings: MissionSettings,
    ) -> None:
        self.id = record.id
        self._turns = record.turns
        self._number = record.number
        self._term = record.term
        self._brief = brief
        self._owner = record.owner
        self._missions = missions
        self._slots = slots
        self._threads = threads
        self._settings = settings

    async def keep(self) -> None:
        """Keep the mission going until it has ended or is another server's."""
        failure = await self._resume()
        if failure is not None:
            missions = self._missions
            await missions.surely(lambda tx: table.fail(tx, self.id, self._term, failure, missions.now_ms()))

    async def _resume(self) -> str | None:
        """Follow one process after the other; return why that leads nowhere, None if there is no more to do."""
        deaths = 0
        while True:
            before = self._turns
            try:
                ended = await self._live()
            except StoreError as error:
                log.error("the store can't be used", extra={"mission": self.id, "reason": str(error)})
                await asyncio.sleep(_RETRY_S)
                continue
            except Dismissed:
                return None
            except Exception as error:
                log.exception("a mission failed", extra={"mission": self.id})
                return str(error)
            if ended is None:
                return None
            log.warning("the process of a mission ended", extra={"mission": self.id, "reason": ended.detail})
            deaths = 1 if self._turns > before else deaths + 1
            if deaths >= (_MOST_KILLED if ended.ending is Ending.KILLED else _MOST_DEATHS):
                return ended.detail
            await asyncio.sleep(_PAUSE_S * (deaths - 1))

    async def _live(self) -> Ended | None:
        """Follow one process to its end; return None if it was the mission's end too."""
        limits = JobLimits(wall_s=_WALL_S, memory_bytes=self._settings.memory_bytes)
        run = await self._started(Job(function=fly, argument=self._brief, limits=limits, talks=True))
        loop, turns = asyncio.get_running_loop(), asyncio.Queue[object]()
        ended = loop.run_in_executor(
            self._threads, run.follow, lambda turn: loop.call_soon_threadsafe(turns.put_nowait, turn)
        )
        talk = asyncio.create_task(self._talk(run, turns))
        try:
            await asyncio.wait((ended, talk), return_when=asyncio.FIRST_COMPLETED)
            await asyncio.wait((ended, talk), timeout=_LAST_WORDS_S)
        finally:
            talk.cancel()
            run.cancel()
            await asyncio.wait((ended, talk))
        if talk.cancelled():
            return await ended
        await talk
        return None

    async def _started(self, job: Job) -> processes.JobRun:
        """Start a process; if that is cancelled meanwhile, the process is ended as soon as it is there."""
        starting = self._threads.submit(processes.run, job)
        try:
            return await asyncio.wrap_future(starting)
        except asyncio.CancelledError:
            starting.add_done_callback(_close)
            raise

    async def _talk(self, run: processes.JobRun, turns: asyncio.Queue[object]) -> None:
        """Hand out inputs and take turns, until the last one."""
        number, due = 0, Next(input=None, decisions=await self._decisions(0))
        while True:
            await self._send(run, due)
            turn = await self._turn(run, turns)
            await self._take(number, turn)
            if turn.over:
                return
            number += 1
            due = await self._next(number)

    async def _send(self, run: processes.JobRun, value: Next | MayPlan) -> None:
        await asyncio.get_running_loop().run_in_executor(self._threads, run.send, value)

    async def _turn(self, run: processes.JobRun, turns: asyncio.Queue[object]) -> Turn:
        """Return the next turn; the process takes a slot whenever it plans."""
        while isinstance(told := await turns.get(), WantsToPlan):
            with self._slots.taken(await self._slots.for_mission(self._owner)):
                await self._send(run, MayPlan())
                assert isinstance(await turns.get(), HasPlanned)
        assert isinstance(told, Turn)
        return told

    async def _take(self, number: int, turn: Turn) -> None:
        if number < self._turns:
            if await self._stored(number) != turn.events:
                raise Diverged(f"what happened after report {number} can't be repeated: it comes out different")
            return
        now_ms = self._missions.now_ms()
        lag_ms = await self._missions.write(lambda tx: table.add_turn(tx, self.id, self._term, number, turn, now_ms))
        if lag_ms is None:
            raise Dismissed
        self._settings.lag(lag_ms / 1000)
        self._turns = number + 1

    async def _next(self, number: int) -> Next:
        with self._missions.bell(table.inputs_of(self.id)) as bell:
            while (found := await self._missions.read(lambda reader: self._due(reader, number))) is None:
                await bell.wait()
                bell.clear()
        return Next(input=found, decisions=await self._decisions(number))

    def _due(self, reader: Connection, number: int) -> Input | None:
        """Return an input, None if it has not come. Raises Dismissed."""
        if table.of_term(reader, self.id, self._term) is None:
            raise Dismissed
        return table.input_at(reader, self._number, number)

    async def _decisions(self, number: int) -> tuple[str, ...]:
        if number >= self._turns:
            return ()
        return tuple(event.data for event in await self._stored(number) if event.type is EventType.DECISION)

    async def _stored(self, number: int) -> tuple[Event, ...]:
        return await self._missions.read(lambda source: table.turn_at(source, self._number, number))


def _close(starting: Future[processes.JobRun]) -> None:
    if not starting.cancelled() and starting.exception() is None:
        starting.result().close()
