"""How soon a long mission has commands again after its process or its server was killed.

``python -m benchmarks recovery`` runs a mission of six slow robots that report ten times a second of mission time, ten
reports to a request. Then it kills the mission's process, and later the server, reports once more each time, and waits
for the commands that answer this report. CPU seconds are given beside the times, which mean less on a busy machine.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import psutil
from support.services.plain_client import ask, frames

from benchmarks.trial.fleets import RealTimeTeam, together
from benchmarks.trial.loads import Used, used
from benchmarks.trial.rows import Judgement, TrialRow, judged, table
from benchmarks.trial.trial_server import TrialServer, running_server
from marsupial.cli.display.messages import say
from marsupial.cli.display.tables import print_text
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model.planning import Budget
from marsupial.model.robots import uniform_team
from marsupial.model.scenario import MissionLimits, Scenario
from marsupial_service.missions.simulated import mission_document

GOAL_S = 5.0
"""For the whole way from the kill, or from the moment a new server answers, to the next commands."""

_EACH_MS = 100
_AT_A_TIME = 10
_SLOWER = 10.0
_CARRIERS, _ROVERS = 3, 1


class LongMission:
    """A mission of six slow robots on a server, and the simulated team that reports to it."""

    def __init__(self, server: TrialServer) -> None:
        scenario = _slow_scenario()
        placed = place_team(scenario, 1)
        how: dict[str, Any] = {"strategy": "temporal", "planner": "greedy", "budget": Budget(steps=1), "seed": 1}
        document = mission_document(scenario, placed, reachable_area(scenario, placed), **how)
        self._path = ask(server.port, "POST", "/v1/missions", document).document["links"]["self"]
        self._team = RealTimeTeam(scenario.grid, {kind.name: kind for kind in scenario.robot_types}, placed)
        self._port = server.port
        self.n = self._seen = 0

    def advance(self, reports: int) -> None:
        """Send reports, ten at a time, and carry out the commands that answer them."""
        last = self.n + reports
        while self.n < last:
            self._report(min(_AT_A_TIME, last - self.n))

    def _report(self, count: int) -> None:
        numbers = range(self.n + 1, self.n + count + 1)
        sent = [{"n": n, **together(self._team.at(n * _EACH_MS))} for n in numbers]
        answer = ask(self._port, "POST", f"{self._path}/reports", {"reports": sent})
        assert answer.status == 200, answer.document
        self.n += count
        for frame in frames(self._port, f"{self._path}/events", self._seen, timeout_s=3600.0):
            self._seen = frame.id
            assert frame.type != "end", frame.data
            if frame.type == "commands":
                batch = json.loads(frame.data)
                self._team.obey(batch)
                if batch["n"] == self.n:
                    return
        raise AssertionError("the stream ended before the commands")


def _slow_scenario() -> Scenario:
    scenario = builtin_scenario("office")
    kinds = tuple(replace(kind, speed_mps=kind.speed_mps / _SLOWER) for kind in scenario.robot_types)
    team = uniform_team(_CARRIERS, _ROVERS)
    return replace(scenario, robot_types=kinds, team=team, limits=MissionLimits(time_ms=360_000_000))


def rows(reports: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Run a mission of so many reports; kill its process, then its server."""
    say(f"recovery: a mission of {reports} reports")
    with running_server() as server:
        mission = LongMission(server)
        mission.advance(reports)
        before, begun_s = used(server), time.monotonic()
        for pid in server.below(3):
            psutil.Process(pid).kill()
        mission.advance(1)
        yield _row("its process was killed", reports, time.monotonic() - begun_s, used(server).since(before))
        server.kill()
        server.start()
        before, begun_s = used(server), time.monotonic()
        mission.advance(1)
        yield _row(
            "its server was killed and restarted", reports, time.monotonic() - begun_s, used(server).since(before)
        )


def _row(after: str, reports: int, seconds: float, cost: Used) -> TrialRow:
    figure = f"{seconds:.1f} s; {cost.server:.1f} + {cost.below:.1f} s of a processor, load {os.getloadavg()[0]:.1f}"
    return TrialRow(
        part="recovery",
        requirement=f"commands of a mission of {reports} reports after {after}",
        figure=figure,
        goal=f"{GOAL_S:g} s at 20,000",
        judgement=judged(seconds <= GOAL_S),
        values={"seconds": seconds, "reports": reports, "server_cpu_s": cost.server, "below_cpu_s": cost.below},
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code: 1 if the goal is missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks recovery", description=__doc__.split("\n")[0])
    parser.add_argument("--reports", type=int, default=20_000, help="reports of the mission (%(default)s)")
    found = list(rows(parser.parse_args(arguments).reports, say))
    print_text(f"{table(found)}\n")
    return 1 if any(row.judgement is Judgement.MISSED for row in found) else 0
