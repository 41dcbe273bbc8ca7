"""Open the missions of a store, and run the simulator as their client."""

import asyncio
import hashlib
import json
import random
import socket
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import psutil
from entry_setup import followed, opened, settings_of
from support.missions.reference_missions import STEPS
from support.waiting import HANG_S

from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model.missionframe import MissionFrame
from marsupial.model.scenario import Scenario
from marsupial.processes.channel import Channel
from marsupial_service.intake.missions import brief_of, report_of
from marsupial_service.intake.reading import ParsedBody
from marsupial_service.intake.simulations import simulation_of
from marsupial_service.missions import packed
from marsupial_service.missions.process import run_mission
from marsupial_service.missions.records import MissionRecord, MissionSettings
from marsupial_service.missions.reported import RobotCommand
from marsupial_service.missions.service import Missions
from marsupial_service.missions.simulated import SimulatedTeam, mission_document
from marsupial_service.missions.table import MISSIONS
from marsupial_service.missions.values import (
    Control,
    Input,
    MissionBatch,
    MissionBrief,
    MissionReport,
    MissionTask,
    PendingInput,
    PlanningSignal,
    StoredEvent,
)
from marsupial_service.schemas.enums import EventType
from marsupial_service.schemas.missions import MissionBody, ReportBody
from marsupial_service.schemas.simulations import SimulationBody
from marsupial_service.settings import ServiceLimits
from marsupial_service.store import Transaction

_ENDED = {"digest": b"d", "name": "hall", "strategy": "temporal", "planner": "auto", "state": "ended", "created_ms": 0}


def body(scenario: str = "lobby", planner: str = "greedy", strategy: str = "temporal", seed: int = 1) -> dict[str, Any]:
    """Return the body of a request for a mission in a built-in scenario."""
    return body_of(builtin_scenario(scenario), planner, strategy, seed)


def body_of(scenario: Scenario, planner: str = "greedy", strategy: str = "temporal", seed: int = 1) -> dict[str, Any]:
    """Return the body of a request for a mission in a scenario."""
    placed = place_team(scenario, seed)
    area = reachable_area(scenario, placed)
    return mission_document(scenario, placed, area, strategy=strategy, planner=planner, budget=STEPS, seed=seed)


def brief(scenario: str = "lobby", planner: str = "greedy", strategy: str = "temporal") -> MissionBrief:
    return brief_from(body(scenario, planner, strategy))


def brief_from(asked: Mapping[str, Any]) -> MissionBrief:
    return brief_of(MissionBody.model_validate(asked), ServiceLimits(), {})


def simulation_brief(asked: Mapping[str, Any]) -> MissionBrief:
    """Return the brief of a simulated mission."""
    found, _ = simulation_of(
        SimulationBody.model_validate(asked), ParsedBody(dict(asked), b"same"), ServiceLimits(), {}
    )
    return found


def team(scenario: str = "lobby", seed: int = 1) -> SimulatedTeam:
    return team_of(builtin_scenario(scenario), seed)


def team_of(scenario: Scenario, seed: int = 1, fleet: type[SimulatedTeam] = SimulatedTeam) -> SimulatedTeam:
    """Return the team of a scenario at its start, with the faults that are to happen."""
    kinds = {kind.name: kind for kind in scenario.robot_types}
    robots, limit_ms = place_team(scenario, seed), scenario.limits.time_ms
    return fleet(scenario.grid, kinds, robots, scenario.faults, limit_ms, seed)


def open_missions(place: Path | str, **settings: object) -> AbstractAsyncContextManager[Missions]:
    return opened(place, lambda store: Missions(store, settings_of(MissionSettings, **settings)))  # type: ignore[arg-type]


async def send(missions: Missions, record: MissionRecord, report: Mapping[str, Any]) -> MissionRecord:
    """Send a report, as the route does."""
    text = json.dumps(report, sort_keys=True).encode()
    read = read_report(await missions.brief(record), report)
    return await missions.reports(record, [(read, hashlib.sha256(text).digest())])


def read_report(brief: MissionBrief, report: Mapping[str, Any]) -> MissionReport:
    """Read a report, as the route does, in the first frame of the mission."""
    return report_of(ReportBody.model_validate(report), brief, MissionFrame.of(brief.grid), 10**6)


def add_mission(tx: Transaction, name: str, owner: str, reports: int, finished_ms: int) -> None:
    """Add an ended mission with so many reports and batches."""
    tx.insert("missions", **_ENDED, id=name, owner=owner, finished_ms=finished_ms)
    number = MISSIONS.existing(tx, name).number
    for n in range(1, reports + 1):
        packed.add_input(tx, number, n, MissionReport(n=n, t_ms=n), bytes((n % 256,)) * 32, 0)
        data = f'{{"event":"reveal","t_ms":{n},"robot":"carrier","cells":[{n},{n * 7919**20},1]}}'
        packed.add_events(tx, number, {n: [StoredEvent(EventType.LOG, data)] * 3}, 0)


@dataclass(slots=True)
class Driver:
    """Runs a simulated team by the commands of a mission; it can be interrupted and resumed."""

    team: SimulatedTeam
    after: int = 0
    batch: int = 0
    unsent: dict[str, Any] | None = None
    edit: Callable[[dict[str, Any]], dict[str, Any]] | None = None
    reports: list[dict[str, Any]] = field(default_factory=list)
    events: list[tuple[int, str, str]] = field(default_factory=list)

    async def drive(self, missions: Missions, record: MissionRecord, most: int | None = None) -> bool:
        """Run until the mission ends (True), or `most` reports are acknowledged."""
        if self.unsent is not None:
            await self._send(missions, record)
        async for event in followed(missions, record.id, self.after):
            self.after = event.seq
            self.events.append((event.seq, event.type, event.data))
            if event.type == "end":
                return True
            if event.type == "state":
                self.team.paused = json.loads(event.data)["state"] == "paused"
            if event.type != "commands":
                continue
            batch = json.loads(event.data)
            assert batch["batch"] == self.batch + 1
            self.batch += 1
            report = self.team.answer(batch)
            if report is None:
                continue
            if self.edit is not None:
                (edit, self.edit) = (self.edit, None)
                report = edit(report)
            self.unsent = report
            await self._send(missions, record)
            if most is not None and len(self.reports) >= most:
                return False
        raise AssertionError("the stream ended before the mission did")

    async def _send(self, missions: Missions, record: MissionRecord) -> None:
        assert self.unsent is not None
        await send(missions, record, self.unsent)
        self.reports.append(self.unsent)
        self.unsent = None


async def over_reports(
    place: Path | str,
    scenario: Scenario,
    *stops: int,
    strategy: str = "temporal",
    fleet: type[SimulatedTeam] = SimulatedTeam,
) -> tuple[str, Driver]:
    """Run a mission, with a restart of the service after each of these numbers of reports; return log and client."""
    driver, mission = Driver(team_of(scenario, fleet=fleet)), ""
    for most in (*stops, None):
        async with open_missions(place) as missions:
            if not mission:
                asked = brief_from(body_of(scenario, strategy=strategy))
                mission = (await missions.create(asked, b"same", owner="me"))[0].id
            record = await missions.of("me", mission)
            if await driver.drive(missions, record, most):
                return await missions.log(record), driver
    raise AssertionError("it has not ended")


async def started(missions: Missions, scenario: str = "lobby", **how: str) -> MissionRecord:
    record, _ = await missions.create(brief(scenario, **how), b"same", owner="me")
    return record


async def kill_now_and_then(processes: Callable[[], Sequence[psutil.Process]], seed: int, times: int) -> None:
    """Kill one of the processes that run, `times` times."""
    draw = random.Random(seed)
    for _ in range(times):
        await asyncio.sleep(draw.uniform(0.05, 0.4))
        found = await asyncio.to_thread(processes)
        if found:
            with suppress(psutil.NoSuchProcess):
                draw.choice(found).kill()


def run(work: Any) -> Any:
    """Run a test's coroutine with a timeout."""

    async def limited() -> Any:
        async with asyncio.timeout(HANG_S):
            return await work

    return asyncio.run(limited())


class Hosted:
    """The loop of a mission in a thread, and the channel to it."""

    def __init__(self, brief: MissionBrief) -> None:
        self.line, theirs = map(Channel, socket.socketpair())
        self._failure: list[BaseException] = []
        self._thread = threading.Thread(target=self._fly, args=(brief, theirs), daemon=True)
        self._thread.start()

    def _fly(self, brief: MissionBrief, line: Channel) -> None:
        try:
            with closing(line):
                run_mission(MissionTask(brief, brief.planner), line)
        except BaseException as error:
            self._failure.append(error)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.line.close()
        self._thread.join(HANG_S)

    def batch(self, due: PendingInput) -> MissionBatch:
        try:
            self.line.send((due,))
            while (told := self.line.receive()) is PlanningSignal.REQUESTED:
                self.line.send(PlanningSignal.ALLOWED)
                assert self.line.receive() is PlanningSignal.DONE
        except (EOFError, OSError):
            self._thread.join(HANG_S)
            raise self._failure[0] from None
        (batch,) = told
        return batch


def replayed(
    brief: MissionBrief, inputs: Sequence[MissionReport | Control], batches: Sequence[MissionBatch]
) -> list[MissionBatch]:
    """Return the batches of a new process for the same inputs and decisions."""
    with Hosted(brief) as hosted:
        return [
            hosted.batch(
                PendingInput(input=one, decisions=tuple(e.data for e in batch.events if e.type is EventType.DECISION))
            )
            for one, batch in zip([None, *inputs], batches, strict=True)
        ]


class Reports:
    """A queue of reports, filled by tests."""

    def __init__(self) -> None:
        self.coming: deque[MissionReport] = deque()

    def order(self, order: RobotCommand, *, stop: bool = False) -> None:
        pass

    def exchange(self, until_ms: int) -> Input:
        return self.coming.popleft()
