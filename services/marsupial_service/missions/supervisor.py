"""The supervisor of one mission: starts its process, sends it inputs, stores its batches, replaces it if it dies.

A mission is only a log of numbered inputs and batches. Input 0 is the brief; the others are reports and controls, which
the server that gets the request stores on arrival. Batch k is everything that the process produced from input k: log
lines, decisions, commands. Storing a batch publishes it: event streams read the store.

    store     inputs    0 1 2 3 4 5 6 7      written by requests
              batches   0 1 2 3 4 .          written here, in order, each once
                            |     |
    process   #1  0 1 2 3   x died          #2 gets all inputs again, with the decisions stored in batches 0 to 4:
    process   #2  0 1 2 3 4 | 5 6 7         it repeats 0 to 4 without planning, then goes on with 5

So a process holds no state that can't be rebuilt, and may be killed at any moment. The batches that #2 repeats must
equal those stored, as clients have acted on them: if one differs, `Diverged` ends the mission. Unless another version
of the code has run it so far (`codeversion`): then it is left as it is, with the reason, for a server of that version.
Once such a mission has been repeated, it is this version's.

The store decides who may write. Each server that takes over a mission begins a new term of it, and every write names
its term: a write of an earlier term changes nothing, and its supervisor ends with `Superseded`. So a server that hangs
and recovers does no harm, and two supervisors of a mission can't both continue.

The messages between supervisor and process, always in this order:

    supervisor   inputs                     ---->   process     up to 32 at a time
                 PlanningSignal.REQUESTED   <----               it has no stored decision and waits
                 PlanningSignal.ALLOWED     ---->               once the owner's quota and a slot allow it
                 PlanningSignal.DONE        <----               the slot is free again
                 batches                    <----               one for each input, in one piece or several

Otherwise a mission fails only if its process crashes or exceeds its memory repeatedly without new results in between.
If the process was killed or can't be started, that is not the mission's fault: the supervisor starts it again, with
growing pauses.
"""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Awaitable, Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import suppress
from dataclasses import dataclass, field, replace

from marsupial.errors import EngineUnavailable, InternalError, UsageError
from marsupial.processes import launcher
from marsupial.processes.jobs import Ended, Ending, Job, JobLimits
from marsupial.processes.launcher import JobRun
from marsupial.strategies.registry import strategy
from marsupial_service.entries.service import RETRY_S, Entries
from marsupial_service.entries.slots import Slots
from marsupial_service.missions import packed, table
from marsupial_service.missions.driver import Driver
from marsupial_service.missions.process import run_mission
from marsupial_service.missions.records import MissionRecord, MissionSettings
from marsupial_service.missions.state import ReportConflict
from marsupial_service.missions.values import MissionBatch, MissionBrief, MissionTask, PendingInput, PlanningSignal
from marsupial_service.planners import engine_name
from marsupial_service.schemas.enums import EventType, MissionPhase
from marsupial_service.schemas.events import QuotaData
from marsupial_service.store import StoreError
from marsupial_service.store.engine import Connection

# a mission fails if its process crashes this often by itself without new results in between
_MOST_CRASHES = 3
# most inputs sent to a process at a time: their batches are stored together
_AT_A_TIME = 32
# how much work of a mission, in seconds, is charged at once: each charge is a transaction
_CHARGED_S = 0.5
# how often a mission that waits for its owner's quota checks: jobs that end may return some
_POLL_S = 1.0
# pause before a process is restarted: it doubles each time, from the first value up to the second
_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 10.0
# missions end by their own time limit; this one ends a stuck process
_WALL_S = 7 * 86400.0
# how long the last messages and the end of the process may be apart, whichever comes first
_LAST_MESSAGES_S = 0.5

log = logging.getLogger("marsupial.missions")


class Diverged(Exception):
    """A new process answered input `number` in another way than is stored: it can't continue the mission."""

    def __init__(self, number: int) -> None:
        super().__init__(f"replaying the mission after input {number} gave a different result")


class Superseded(Exception):
    """The mission has ended, or another server has taken it over."""


@dataclass(eq=False, slots=True)
class MissionSupervisor:
    """Runs one open mission that this server holds; `driver` makes its robots report if they are simulated."""

    record: MissionRecord
    brief: MissionBrief
    missions: Entries[MissionRecord]
    slots: Slots
    threads: Executor
    settings: MissionSettings
    driver: Driver | None
    leave: Callable[[MissionRecord, str], Awaitable[None]]  # if this server can't continue it, with the reason
    _batches: int = field(init=False)  # stored so far
    _worked_s: float = field(default=0.0, init=False)  # not yet charged
    _is_foreign: bool = field(init=False)  # whether another version has run it so far

    def __post_init__(self) -> None:
        self._batches = self.record.batches
        self._is_foreign = self.record.version != self.settings.version

    async def run(self) -> None:
        """Keep the mission going until it has ended or belongs to another server."""
        record, brief, now_ms = self.record, self.brief, self.missions.now_ms
        try:
            task = await asyncio.to_thread(_task_of, brief, self.settings.commands)
        except UsageError as error:
            planner = f"strategy {brief.strategy}, planner {brief.planner}"
            await self.leave(record, f"this server can't plan it ({planner}): {error}")
            return
        failure = await self._run_processes(task)
        if failure is not None and self._is_foreign:
            begun, here = record.version or "(unknown)", self.settings.version
            await self.leave(record, f"begun by version {begun}, which version {here} can't continue: {failure}")
        elif failure is not None:
            await self.missions.write_until_stored(lambda tx: table.fail(tx, record.id, record.term, failure, now_ms()))

    async def _run_processes(self, task: MissionTask) -> str | None:
        """Run one process after another; return why the mission has failed, None if there is no more to do."""
        crashes = losses = 0
        while True:
            before = self._batches
            try:
                ended = await self._run_process(task)
            except StoreError:
                if not await self._is_ours():
                    return None
                continue
            except Superseded:
                return None
            except InternalError as error:  # nothing can be started at the moment
                ended = Ended(ending=Ending.KILLED, detail=str(error))
            except (ReportConflict, Diverged) as error:
                if not self._is_foreign:
                    log.exception("mission failed", extra={"mission": self.record.id})
                return str(error)
            except Exception as error:
                self.missions.background.report("mission process", error)
                ended = Ended(ending=Ending.CRASHED, detail=f"internal error ({type(error).__name__})")
            if ended is None:
                return None
            log.warning("mission process ended", extra={"mission": self.record.id, "reason": ended.detail})
            if self._batches > before:
                crashes = losses = 0
            # only its own crashes end a mission: kills and failed starts are not its fault
            losses += 1
            crashes += ended.ending is not Ending.KILLED
            if crashes >= _MOST_CRASHES:
                return ended.detail
            self.settings.resumed("restart")
            await asyncio.sleep(min(_PAUSE_S * 2 ** min(losses - 1, 10), _LONGEST_PAUSE_S))

    async def _is_ours(self) -> bool:
        """Wait until the store can be read again; return whether the mission is open and still this server's."""
        while True:
            await asyncio.sleep(RETRY_S)
            with suppress(StoreError):
                record = await self.missions.read(
                    lambda reader: table.current_in_term(reader, self.record.id, self.record.term)
                )
                # a failed write may be stored after all: the connection may have broken right after the commit
                if record is not None:
                    self._batches = record.batches
                return record is not None

    async def _run_process(self, task: MissionTask) -> Ended | None:
        """Run one process to its end; return None if that was the mission's end too."""
        limits = JobLimits(wall_s=_WALL_S, memory_bytes=self.settings.limits.memory_bytes)
        run = await self._start_process(Job(function=run_mission, argument=task, limits=limits, talks=True))
        loop, messages = asyncio.get_running_loop(), asyncio.Queue[object]()
        ended = loop.run_in_executor(
            self.threads, run.follow, lambda value: loop.call_soon_threadsafe(messages.put_nowait, value)
        )
        communication = asyncio.create_task(self._communicate(run, messages))
        try:
            await asyncio.wait((ended, communication), return_when=asyncio.FIRST_COMPLETED)
            await asyncio.wait((ended, communication), timeout=_LAST_MESSAGES_S)
        finally:
            communication.cancel()
            run.cancel()
            await asyncio.wait((ended, communication))
            self._charge(0.0)
        if communication.cancelled():
            return await ended
        await communication
        return None

    async def _start_process(self, job: Job) -> JobRun:
        """Start a process; on cancellation, end it as soon as it has started."""
        starting = self.threads.submit(launcher.run, job)
        try:
            return await asyncio.wrap_future(starting)
        except asyncio.CancelledError:
            starting.add_done_callback(_close)
            raise

    async def _communicate(self, run: JobRun, messages: asyncio.Queue[object]) -> None:
        """Send inputs and store batches, until the last batch."""
        number = sent = 0
        stored: deque[bytes] = deque()  # what must be repeated of the inputs that were sent
        with self.missions.subscriptions.subscribe(table.inputs_of(self.record.id)) as news:
            news.set()
            while True:
                # what is stored is sent ahead, so that the process need not wait for it
                while sent < self._batches and sent - number <= _AT_A_TIME:
                    stored += (texts := await self._send_stored(run, sent))
                    sent += len(texts)
                if not stored and (self._is_foreign or self.record.reason):
                    await self._adopt()
                if number == sent:
                    sent += await self._send_inputs(run, number, news)
                match await self._next(messages, is_new=number >= self._batches):
                    case tuple(batches):
                        await self._store_batches(number, batches, stored)
                        if self.driver is not None:
                            self.driver.observe(batches)
                        number += len(batches)
                        if batches[-1].over:
                            return
                    case PlanningSignal.REQUESTED:
                        if stored:
                            raise Diverged(number)
                        await self._plan(run, messages)
                    case other:
                        raise AssertionError(other)

    async def _adopt(self) -> None:
        """Make the mission, whose batches have all been repeated, one of this version. Raises Superseded."""
        id, term, version = self.record.id, self.record.term, self.settings.version
        if not await self.missions.write(lambda tx: table.adopt(tx, id, term, version)):
            raise Superseded
        self._is_foreign, self.record = False, replace(self.record, reason="")

    async def _next(self, messages: asyncio.Queue[object], *, is_new: bool) -> object:
        """Return the next message of the process; charge its work unless an earlier process has done the same work."""
        begun_s = time.monotonic()
        try:
            return await messages.get()
        finally:
            self._worked_s += time.monotonic() - begun_s if is_new else 0.0
            if self._worked_s >= _CHARGED_S:
                self._charge(0.0)

    def _charge(self, planned_s: float) -> None:
        """Charge the owner for a planning and for the work of the process since the last charge."""
        used_s, self._worked_s = self._worked_s + planned_s, 0.0
        if used_s:
            self.missions.charge(self.record.owner, used_s)

    async def _plan(self, run: JobRun, messages: asyncio.Queue[object]) -> None:
        """Allow a planning once there are quota and a slot; charge it however it ends."""
        await self._wait_for_quota()
        with self.slots.holding(await self.slots.for_owner(self.record.owner)):
            begun_s = time.monotonic()
            try:
                await self._send(run, PlanningSignal.ALLOWED)
                assert await messages.get() is PlanningSignal.DONE
            finally:
                self._charge(time.monotonic() - begun_s)

    async def _wait_for_quota(self) -> None:
        """Wait until the owner may plan again; send an event at the start and at the end of the wait."""
        missions = self.missions
        if not missions.quota.is_bounded:
            return
        # the previous server may have sent the event before this one took over the mission
        number, batch = self.record.number, self._batches
        last = await missions.read(lambda reader: tuple(packed.events_of(reader, number, batch, batch)))
        messages = [QuotaData.model_validate_json(event.data) for event in last if event.type is EventType.QUOTA]
        waited = bool(messages) and messages[-1].state == "waiting"
        while wait_s := await missions.read(self._quota_wait_s):
            if not waited:
                waited = True
                await self._add_quota_event(missions.quota.wait_reason(table.required_s(self.brief), wait_s), wait_s)
            await asyncio.sleep(min(wait_s, _POLL_S))
        if waited:
            await self._add_quota_event("", 0.0)

    def _quota_wait_s(self, reader: Connection) -> float:
        """Return how long the owner must wait to plan; a mission being cancelled does not wait. Raises Superseded."""
        if self._current(reader).state is MissionPhase.CANCELLING:
            return 0.0
        missions = self.missions
        return missions.quota.wait_s(reader, self.record.owner, table.required_s(self.brief), missions.now_ms())

    def _current(self, reader: Connection) -> MissionRecord:
        """Return the mission as it is now. Raises Superseded."""
        record = table.current_in_term(reader, self.record.id, self.record.term)
        if record is None:
            raise Superseded
        return record

    async def _add_quota_event(self, reason: str, wait_s: float) -> None:
        id, term, now_ms = self.record.id, self.record.term, self.missions.now_ms()
        await self.missions.write(lambda tx: table.add_quota_event(tx, id, term, reason, wait_s, now_ms))

    async def _send_stored(self, run: JobRun, number: int) -> tuple[bytes, ...]:
        """Send inputs that were answered before, from `number` on, with the decisions; return the stored batches."""
        last = min(number + _AT_A_TIME, self._batches) - 1

        def answered(reader: Connection) -> tuple[list[bytes | None], tuple[bytes, ...]]:
            inputs = packed.inputs_from(reader, self.record.number, number, last - number + 1)
            # input 0 is the brief, which the process has
            texts = [None] * (number == 0) + [text for text, _ in inputs]
            return texts, tuple(packed.batches_of(reader, self.record.number, number, last))

        inputs, batches = await self.missions.read(answered)
        pairs = zip(inputs, batches, strict=True)
        await self._send(run, tuple(PendingInput(input=one, decisions=packed.decisions_in(b)) for one, b in pairs))
        return batches

    async def _send_inputs(self, run: JobRun, number: int, news: asyncio.Event) -> int:
        """Wait for due inputs from `number` on, send them, and return how many they are."""
        inputs = [None] if number == 0 else await self._inputs(number, news)
        await self._send(run, tuple(PendingInput(input=one) for one in inputs))
        return len(inputs)

    async def _send(self, run: JobRun, value: tuple[PendingInput, ...] | PlanningSignal) -> None:
        if run.put(value):
            await asyncio.get_running_loop().run_in_executor(self.threads, run.drain)

    async def _store_batches(self, number: int, batches: Sequence[MissionBatch], stored: deque[bytes]) -> None:
        while batches and stored:
            if packed.text_of(batches[0].events) != stored.popleft():
                raise Diverged(number)
            number, batches = number + 1, batches[1:]
        if not batches:
            return
        now_ms = self.missions.now_ms()
        lags_ms = await self.missions.write(
            lambda tx: table.add_batches(tx, self.record.id, self.record.term, number, batches, now_ms)
        )
        if lags_ms is None:
            raise Superseded
        for lag_ms in lags_ms:
            self.settings.lag(lag_ms / 1000)
        self._batches = number + len(batches)

    async def _inputs(self, number: int, news: asyncio.Event) -> Sequence[bytes]:
        """Wait for input `number`; return the stored inputs from there on. Set `news` if there may be more."""

        def due_inputs(reader: Connection) -> tuple[bytes, ...]:
            inputs = packed.inputs_from(reader, self._current(reader).number, number, _AT_A_TIME)
            return tuple(text for text, _ in inputs)

        found: tuple[bytes, ...] = ()
        while not found:
            if not news.is_set():
                await (news.wait() if self.driver is None else self.driver.wait(news))
            news.clear()
            found = await self.missions.read(due_inputs)
        if len(found) == _AT_A_TIME:
            news.set()
        return found


def _task_of(brief: MissionBrief, commands: Mapping[str, str]) -> MissionTask:
    """Return the task of a mission. Raises UsageError if this server does not have its strategy or planner."""
    task = MissionTask(brief, engine_name(brief.planner, commands))
    try:
        strategy(brief.strategy, planner=task.engine, budget=brief.budget)
    except (UsageError, EngineUnavailable) as error:
        raise UsageError(task.without_command(str(error))) from error
    return task


def _close(starting: Future[JobRun]) -> None:
    if not starting.cancelled() and starting.exception() is None:
        starting.result().close()
