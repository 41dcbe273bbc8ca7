"""Fleets of simulated robots that report at a wall-clock rate and follow their commands.

Run as ``python -m benchmarks.trial.fleets LOAD`` in its own process, so its cost is separate from that of servers.
One event loop handles all sockets, so that hundreds of requests and events per second cost little.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections import Counter, defaultdict
from contextlib import aclosing, suppress
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np

from benchmarks.trial.async_connection import AsyncConnection
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model.planning import Budget
from marsupial.model.robots import uniform_team
from marsupial.model.runs import runs_of
from marsupial.model.scenario import PlanningTime, Scenario
from marsupial_service.missions.simulated import SimulatedTeam, mission_document

_LAST_S = 10.0
"""How long to wait for commands after the last report."""

_AGAIN_S = 0.05


class Speaker(StrEnum):
    """The reporter: the team in one report, or each robot by its own count, in a request each or all in one."""

    TEAM = "team"
    ROBOTS = "robots"
    ROBOTS_TOGETHER = "robots together"


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """The work of the fleets.

    Parameters
    ----------
    hz
        Reports per second of each fleet, or of each of its robots.
    seconds
        Duration after the start of the last fleet.
    carriers, rovers
        Number of carriers of a fleet, and of rovers aboard each.
    budget_s
        The planner's budget; None for one step.
    apart_s
        Time between the starts of two fleets: starting a process takes time, and fleets should not report in step.
    """

    port: int
    fleets: int
    hz: float
    seconds: float
    speaker: Speaker
    scenario: str = "maze"
    planner: str = "greedy"
    carriers: int = 8
    rovers: int = 2
    budget_s: float | None = None
    apart_s: float = 0.49

    @property
    def robots(self) -> int:
        """Number of robots in a fleet."""
        return self.carriers * (1 + self.rovers)

    @property
    def text(self) -> str:
        """The same as JSON."""
        return json.dumps(asdict(self))


@dataclass(slots=True, kw_only=True)
class FleetOutcome:
    """The measurements of a load.

    Attributes
    ----------
    due
        Reports due in the time; fewer are `sent` if answers are slow.
    lags_s
        Time from sending a report to the arrival of the commands that answer it.
    plans, commands
        Numbers of decisions, and of commands to robots.
    seconds, cpu_s
        Time from the first to the last report, and CPU time of this process meanwhile.
    odd
        Answers other than 200, by status.
    """

    due: int = 0
    sent: int = 0
    lags_s: list[float]
    plans: int = 0
    commands: int = 0
    seconds: float = 0.0
    cpu_s: float = 0.0
    odd: dict[str, int]


class RealTimeTeam(SimulatedTeam):
    """A simulated team whose time passes by the clock, independent of commands."""

    def obey(self, batch: dict[str, Any]) -> int:
        """Start the commands of a batch, and return their number."""
        for command in batch["commands"]:
            self._execute(command)
        return len(batch["commands"])

    def at(self, t_ms: int) -> dict[str, dict[str, Any]]:
        """Advance time to `t_ms`, and return each robot's report, except for its count."""
        seen: dict[str, list[Any]] = defaultdict(list)
        finished: dict[str, list[int]] = defaultdict(list)
        while True:
            news = self._world.advance(t_ms)
            for name, cells in news.revealed:
                seen[name].append(cells)
            for name in news.finished:
                if (number := self._ids.pop(name, None)) is not None and number not in self._ids.values():
                    finished[name].append(number)  # reported by the last robot involved
            if news.t_ms >= t_ms and not (news.revealed or news.finished):
                break
        codes = self._world.grid.cells.ravel()
        return {
            robot.name: {
                "t_ms": t_ms,
                "revealed": [
                    {"robot": robot.name, "runs": runs_of(np.sort(np.concatenate(found)), codes)}
                    for found in ([seen[robot.name]] if robot.name in seen else ())
                ],
                "robots": (
                    [self._update(robot).model_dump(mode="json", exclude_none=True)] if robot.cell is not None else []
                ),
                "finished": finished[robot.name],
            }
            for robot in self._world.robots()
        }


def together(said: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Join the reports of all robots into a report of the team."""
    first, *_ = said.values()
    return {"t_ms": first["t_ms"]} | {
        key: [item for one in said.values() for item in one[key]] for key in ("revealed", "robots", "finished")
    }


class ClientFleet:
    """One fleet and its mission."""

    def __init__(self, load: Load, world: Scenario, number: int, outcome: FleetOutcome) -> None:
        placed = place_team(world, number)
        steps = Budget(steps=1) if load.budget_s is None else Budget(seconds=load.budget_s)
        area = reachable_area(world, placed)
        how: dict[str, Any] = {"strategy": "temporal", "planner": load.planner, "budget": steps, "seed": number}
        self.brief = json.dumps(mission_document(world, placed, area, **how)).encode()
        self.team = RealTimeTeam(world.grid, {kind.name: kind for kind in world.robot_types}, placed)
        self._load = load
        self._outcome = outcome
        self._path = ""
        self._count = 0
        self._unanswered: dict[tuple[str | None, int], float] = {}
        self._over = False

    async def run(self, begins_s: float, ends_s: float) -> None:
        """Start a mission at a time of the loop's clock, and report until `ends_s`."""
        await asyncio.sleep(begins_s - asyncio.get_running_loop().time())
        first = await AsyncConnection.to(self._load.port)
        made = await first.post("/v1/missions", self.brief)
        assert made.status == 201, made.body
        self._path = json.loads(made.body)["links"]["self"]
        following = asyncio.create_task(self._follow())
        others = self._load.robots - 1 if self._load.speaker is Speaker.ROBOTS else 0
        connections = [first, *[await AsyncConnection.to(self._load.port) for _ in range(others)]]
        await self._report(connections, ends_s)
        with suppress(TimeoutError):
            async with asyncio.timeout(_LAST_S):
                while self._unanswered and not following.done():
                    await asyncio.sleep(_AGAIN_S)
        following.cancel()
        await asyncio.wait((following,))
        await connections[0].post(f"{self._path}/cancel", b"")
        for connection in connections:
            connection.writer.close()

    async def _report(self, connections: list[AsyncConnection], ends_s: float) -> None:
        loop, period_s = asyncio.get_running_loop(), 1 / self._load.hz
        begins_s = due_s = loop.time()
        while due_s < ends_s and not self._over:
            await asyncio.sleep(due_s - loop.time())
            self._count += 1
            self._outcome.due += 1 if self._load.speaker is Speaker.TEAM else self._load.robots
            if loop.time() < due_s + period_s:  # else this report is skipped
                await self._send(connections, self.team.at(round(1000 * (loop.time() - begins_s))))
            else:
                self._count -= 1
            due_s += period_s

    async def _send(self, connections: list[AsyncConnection], said: dict[str, dict[str, Any]]) -> None:
        if self._load.speaker is Speaker.TEAM:
            names: list[str | None] = [None]
            sent = [{"n": self._count, **together(said)}]
        else:
            names = list(said)
            sent = [{"n": self._count, "robot": name, **one} for name, one in said.items()]
        now_s = time.perf_counter()
        self._unanswered |= dict.fromkeys(((name, self._count) for name in names), now_s)
        self._outcome.sent += len(sent)
        if self._load.speaker is Speaker.ROBOTS_TOGETHER:
            bodies = [json.dumps({"reports": sent}).encode()]
        else:
            bodies = [json.dumps(one).encode() for one in sent]
        post = partial(AsyncConnection.post, path=f"{self._path}/reports")
        answers = await asyncio.gather(
            *(post(connection, body=body) for connection, body in zip(connections, bodies, strict=False))
        )
        for answer in answers:
            if answer.status != 200:
                word = f"{answer.status} {answer.body[:200].decode()}"
                self._outcome.odd[word] = self._outcome.odd.get(word, 0) + 1

    async def _follow(self) -> None:
        answered: Counter[str | None] = Counter()
        stream = await AsyncConnection.to(self._load.port)
        async with aclosing(stream.events(f"{self._path}/events")) as events:
            async for kind, data in events:
                self._outcome.plans += kind == b"decision"
                self._over |= kind == b"end"
                if kind == b"commands":
                    batch = json.loads(data)
                    self._outcome.commands += self.team.obey(batch)
                    for name, count in ((None, batch["n"]), *batch.get("robots", {}).items()):
                        self._answer(name, answered[name], count)
                        answered[name] = count
        stream.writer.close()

    def _answer(self, name: str | None, before: int, count: int) -> None:
        for n in range(before + 1, count + 1):
            sent_s = self._unanswered.pop((name, n), None)
            if sent_s is not None:
                self._outcome.lags_s.append(time.perf_counter() - sent_s)


async def carry_out(load: Load) -> FleetOutcome:
    """Run all fleets."""
    outcome = FleetOutcome(lags_s=[], odd={})
    world = replace(builtin_scenario(load.scenario), team=uniform_team(load.carriers, load.rovers))
    world = replace(world, planning_time=PlanningTime.CHARGED if load.budget_s else PlanningTime.INSTANT)
    fleets = [ClientFleet(load, world, number, outcome) for number in range(1, load.fleets + 1)]
    begun_s, cpu_s = asyncio.get_running_loop().time(), time.process_time()
    ends_s = begun_s + load.seconds + (load.fleets - 1) * load.apart_s
    await asyncio.gather(*(fleet.run(begun_s + i * load.apart_s, ends_s) for i, fleet in enumerate(fleets)))
    outcome.seconds, outcome.cpu_s = ends_s - begun_s, time.process_time() - cpu_s
    return outcome


def main(text: str) -> None:
    """Run the load described in JSON, and print the outcome."""
    fields = json.loads(text)
    load = Load(**{**fields, "speaker": Speaker(fields["speaker"])})
    print(json.dumps(asdict(asyncio.run(carry_out(load)))))


if __name__ == "__main__":
    main(sys.argv[1])
