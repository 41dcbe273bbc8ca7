"""A fleet with all faults and an operator, behind a proxy that delays, repeats, drops and refuses requests.

24 simulated robots explore while they fail, return, slow down, get stuck, refuse commands and miss their goals, doors
close, and an operator pauses, resumes and winds the mission down. The report of its end must be that of the simulated
robots: who is aboard and lost, what is known, how far each has driven.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any, cast

import numpy as np

from benchmarks.trial.rows import TrialRow, judged, none_of
from benchmarks.trial.trial_server import running_server
from benchmarks.trial.unreliable import UnreliableProxy
from marsupial.formats.loglines import LogDecoder
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model import Budget, Cell, MissionEnded, RobotLost, RobotReturned, Role
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.mission import Status
from marsupial.model.robots import uniform_team
from marsupial.model.runs import drawn
from marsupial.model.world import RobotReport
from marsupial_client import Client, Conflict, Mission
from marsupial_client.mission_documents import Brief, News
from marsupial_service.missions.simulated import SimulatedTeam, mission_document

FLEET = "a fleet with faults"

_CARRIERS, _ROVERS = 8, 2
_SHARE = 0.15
"""Share of requests that go wrong."""

_PAUSED_S, _WOUND_DOWN_S = 40.0, 110.0
"""Mission times from which the operator pauses, and winds down."""

_PAUSE_S = 2.0
_PATIENCE_S = 60.0

_FAULTS = (
    Fault(kind=FaultKind.LOST, robot="rover1_1", at_ms=20_000),
    Fault(kind=FaultKind.LOST, robot="carrier2", at_ms=30_000),
    Fault(kind=FaultKind.RETURNS, robot="carrier2", at_ms=60_000),
    Fault(kind=FaultKind.JOINS, robot="carrier8", at_ms=25_000),
    Fault(kind=FaultKind.SLOWS, robot="carrier3", at_ms=15_000, share=0.6),
    Fault(kind=FaultKind.SLOWS, robot="carrier4", at_ms=0, share=0.4, reported=False),
    Fault(kind=FaultKind.STUCK, rate_per_h=200, for_ms=5000),
    Fault(kind=FaultKind.DECLINES, rate_per_h=200, seed=2),
    Fault(kind=FaultKind.DOCKING_FAILS, rate_per_h=100, seed=3),
    Fault(kind=FaultKind.GROUND, area=(Cell(60, 60), Cell(63, 63)), terrain=0, at_ms=35_000),
    Fault(kind=FaultKind.MISSED_CELLS, share=0.02),
    Fault(kind=FaultKind.POSITION_NOISE, robot="carrier5", share=0.05),
)


class TruthfulTeam(SimulatedTeam):
    """Simulated robots, and what is true of them."""

    @property
    def now_ms(self) -> int:
        """Mission time."""
        return self._world.now_ms

    @property
    def robots(self) -> tuple[RobotReport, ...]:
        """The robots as they are."""
        return self._world.robots()

    @property
    def known(self) -> np.ndarray[Any, Any]:
        """The cells that the robots have seen (height, width)."""
        return self._world.grid.cells

    def metres(self) -> dict[str, float]:
        """Return how far each robot has driven."""
        return {robot.name: round(self._world.distance_m(robot.name), 3) for robot in self.robots}


class Operator:
    """Pauses a mission, resumes it, and winds it down, over the same proxy."""

    def __init__(self, url: str, mission: str) -> None:
        self._url, self._mission = url, mission
        self._paused = self._wound_down = False
        self._threads: list[threading.Thread] = []

    def watch(self, t_ms: int) -> None:
        """Act at the mission times of a plan of their own; return at once."""
        if not self._paused and t_ms >= 1000 * _PAUSED_S:
            self._paused = True
            self._begin(self._pause)
        elif not self._wound_down and t_ms >= 1000 * _WOUND_DOWN_S:
            self._wound_down = True
            self._begin(lambda mission: mission.wind_down())

    def join(self) -> None:
        """Wait until all requests are answered."""
        for thread in self._threads:
            thread.join()

    def _begin(self, act: Callable[[Mission], object]) -> None:
        def acting() -> None:
            with Client(self._url, patience_s=_PATIENCE_S) as client, suppress(Conflict):  # the mission may be over
                act(client.mission(self._mission))

        self._threads.append(threading.Thread(target=acting, daemon=True))
        self._threads[-1].start()

    @staticmethod
    def _pause(mission: Mission) -> None:
        mission.pause()
        time.sleep(_PAUSE_S)
        mission.resume()
        # a copy of the pause may arrive late: an operator looks again
        for _ in range(4):
            time.sleep(_PAUSE_S)
            if mission.refresh()["state"] == "paused":
                mission.resume()


def rows(missions: int, seed: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Run missions behind the proxy, and compare their reports with what is true."""
    wrong: list[str] = []
    with running_server() as server:
        for number in range(seed, seed + missions):
            with UnreliableProxy(server.port, _SHARE, number) as proxy:
                begun = time.monotonic()
                ended, team, faults = run(f"http://127.0.0.1:{proxy.port}", number)
                wrong += [f"{number}: {fault}" for fault in faults]
                told = ", ".join(f"{count} {what}" for what, count in sorted(proxy.injected.items()))
                say(f"{FLEET}: {ended.status} after {time.monotonic() - begun:.0f} s: {ended.reason}")
                yield TrialRow(
                    part=FLEET,
                    requirement=f"a mission of {len(team.robots)} robots with all faults ends behind a bad proxy",
                    figure=f"{ended.status}, {proxy.requests} requests: {told}",
                    goal="as the operator says",
                    judgement=judged(ended.status is Status.CANCELLED),
                    values={"requests": proxy.requests, **proxy.injected},
                )
    said = "".join(f"; {fault}" for fault in wrong[:5])
    yield none_of(FLEET, "parts of the reports of ends that are not true", len(wrong), said)


def run(
    url: str, seed: int, scenario_name: str = "maze", carriers: int = _CARRIERS
) -> tuple[MissionEnded, TruthfulTeam, list[str]]:
    """Run a mission of the service at a URL; return its end, the team, and what the report of the end gets wrong."""
    scenario = replace(builtin_scenario(scenario_name), team=uniform_team(carriers, _ROVERS))
    placed = place_team(scenario, seed)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    asked = mission_document(
        scenario,
        placed,
        reachable_area(scenario, placed),
        strategy="temporal",
        planner="greedy",
        budget=Budget(steps=1),
        seed=seed,
    )
    names = {robot.name for robot in placed}
    faults = [fault for fault in _FAULTS if fault.robot is None or fault.robot in names]
    team = TruthfulTeam(scenario.grid, kinds, placed, faults, scenario.limits.time_ms, seed)
    lost: set[str] = set()
    ended: MissionEnded | None = None
    decoder = LogDecoder()
    with Client(url, patience_s=_PATIENCE_S) as client:
        mission = client.begin(cast(Brief, asked))
        operator = Operator(url, mission.id)
        for event in mission.events():
            if event.type == "log":
                for told in decoder.events(event.data):
                    match told:
                        case RobotLost():
                            lost.add(told.robot)
                        case RobotReturned():
                            lost.discard(told.robot)
                        case MissionEnded():
                            ended = told
            elif event.type == "state":
                team.paused = event.data["state"] == "paused"
            elif event.type == "commands":
                report = team.answer(event.data)
                if report is not None:
                    mission.report(cast(News, report))
                    operator.watch(team.now_ms)
        operator.join()
        assert ended is not None, "the stream ends without an end of the log"
        known = mission.known_map()
        cells = drawn(tuple(known["runs"]), (known["height"], known["width"]))
    return ended, team, list(_untrue(ended, team, lost, cells, {k.name: k.role for k in kinds.values()}))


def _untrue(
    ended: MissionEnded, team: TruthfulTeam, lost: set[str], cells: np.ndarray[Any, Any], roles: dict[str, Role]
) -> Iterator[str]:
    """Yield what the report of an end says that is not true."""
    aboard = {robot.name for robot in team.robots if robot.carrier is not None}
    if set(ended.aboard) != aboard:
        yield f"aboard are {sorted(aboard)}, not {sorted(ended.aboard)}"
    if lost != {robot.name for robot in team.robots if robot.lost}:
        yield f"lost are others than {sorted(lost)}"
    if not np.array_equal(cells, team.known):
        yield f"{np.count_nonzero(cells != team.known)} cells of the known map"
    metres = team.metres()
    yield from (f"{name} drove {metres[name]} m, not {m} m" for name, m in ended.distance_m if m != metres[name])
    out = [r.name for r in team.robots if roles[r.type] is Role.ROVER and r.carrier is None and not r.lost]
    named = [name for name in out if name in ended.reason]
    if out != named or ("all rovers are aboard" in ended.reason) != (not out):
        yield f"not aboard are {out}: {ended.reason}"
