"""A fleet with all faults, batteries and an operator, behind a bad proxy and a service that is killed twice.

24 simulated robots explore while they fail, return, slow down, get stuck, refuse commands and miss their goals,
batteries run low, and a door closes and opens. An operator pauses, resumes, draws zones and winds the mission down, or
is content with a part of the area. The proxy delays, repeats, drops and refuses requests. The report of the end must be
that of the simulated robots: who is aboard and lost, what is known, how far each has driven, what is left.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any, cast

import numpy as np
from support.services.servers import Server

from benchmarks.trial.rows import TrialRow, judged, none_of
from benchmarks.trial.trial_server import TrialServer, running_server
from benchmarks.trial.unreliable import UnreliableProxy
from marsupial.formats.loglines import LogDecoder
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model import Budget, Cell, MissionEnded, RobotLost, RobotReturned, Role
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.grid import UNKNOWN, Grid
from marsupial.model.mission import PlacedRobot, Status
from marsupial.model.robots import Battery
from marsupial.model.runs import drawn
from marsupial.model.scenario import Scenario
from marsupial.model.world import RobotReport
from marsupial.processes import reaper
from marsupial_client import Client, Conflict, Mission
from marsupial_client.mission_documents import Brief, News
from marsupial_service.missions.simulated import SimulatedTeam, mission_document

FLEET = "a fleet with faults"

_CARRIERS, _ROVERS = 6, 3
_SHARE = 0.15
"""Share of requests that go wrong."""

_ENOUGH = 0.9
"""Share of the area that every other mission explores; the others are wound down."""

_BATTERIES = {Role.CARRIER: Battery(capacity_j=24_000, charge_w=400), Role.ROVER: Battery(capacity_j=2500, charge_w=50)}
_CHARGERS = 2

_PAUSE_S = 2.0
_PATIENCE_S = 60.0
_LOOK_S = 0.5

_FAULTS = (
    Fault(kind=FaultKind.LOST, robot="rover1_1", at_ms=20_000),
    Fault(kind=FaultKind.LOST, robot="carrier2", at_ms=30_000),
    Fault(kind=FaultKind.RETURNS, robot="carrier2", at_ms=60_000),
    Fault(kind=FaultKind.JOINS, robot="carrier6", at_ms=25_000),
    Fault(kind=FaultKind.SLOWS, robot="carrier3", at_ms=15_000, share=0.6),
    Fault(kind=FaultKind.SLOWS, robot="carrier4", at_ms=0, share=0.4, reported=False),
    Fault(kind=FaultKind.STUCK, rate_per_h=200, for_ms=5000),
    Fault(kind=FaultKind.DECLINES, rate_per_h=200, seed=2),
    Fault(kind=FaultKind.DOCKING_FAILS, rate_per_h=100, seed=3),
    Fault(kind=FaultKind.GROUND, area=(Cell(60, 60), Cell(63, 63)), terrain=0, at_ms=35_000),
    Fault(kind=FaultKind.GROUND, area=(Cell(48, 108), Cell(54, 111)), terrain=0, at_ms=20_000),
    Fault(kind=FaultKind.GROUND, area=(Cell(48, 108), Cell(54, 111)), terrain=2, at_ms=70_000),
    Fault(kind=FaultKind.MISSED_CELLS, share=0.02),
    Fault(kind=FaultKind.POSITION_NOISE, robot="carrier5", share=0.05),
)


class TruthfulTeam(SimulatedTeam):
    """Simulated robots, and what is true of them."""

    reports = 0
    """Number of reports that the service has."""

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


FleetAct = Callable[[Mission], object]


class Operator:
    """Acts on a mission from some mission times on, over the same proxy."""

    def __init__(self, url: str, mission: str, acts: Iterable[tuple[float, FleetAct]]) -> None:
        self._url, self._mission = url, mission
        self._left = sorted(acts, key=lambda one: one[0])
        self._threads: list[threading.Thread] = []

    def watch(self, t_ms: int) -> None:
        """Begin what is due by the mission time; return at once."""
        while self._left and t_ms >= 1000 * self._left[0][0]:
            _, act = self._left.pop(0)
            self._threads.append(threading.Thread(target=self._do, args=(act,), daemon=True))
            self._threads[-1].start()

    def join(self) -> None:
        """Wait until all requests are answered."""
        for thread in self._threads:
            thread.join()

    def _do(self, act: FleetAct) -> None:
        with Client(self._url, patience_s=_PATIENCE_S) as client, suppress(Conflict):  # the mission may be over
            act(client.mission(self._mission))


def _pause(mission: Mission) -> None:
    mission.pause()
    time.sleep(_PAUSE_S)
    mission.resume()
    # a copy of the pause may arrive late: an operator looks again
    for _ in range(4):
        time.sleep(_PAUSE_S)
        if mission.refresh()["state"] == "paused":
            mission.resume()


def _square(x: float, y: float, side: float) -> list[list[float]]:
    return [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]


_ACTS: tuple[tuple[float, FleetAct], ...] = (
    (25, lambda mission: mission.set_zone("lab", {"kind": "no_go", "polygon_m": _square(20, 40, 6)})),
    (40, _pause),
    (50, lambda mission: mission.set_zone("east", {"kind": "priority", "weight": 10, "polygon_m": _square(30, 5, 9)})),
    (75, lambda mission: mission.remove_zone("lab")),
)
_WOUND_DOWN_S = 110.0
_KILLED_S = (41.0, 80.0)
"""Mission times from which the operator acts, and the service is killed."""


def rows(missions: int, seed: int, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Run missions behind the proxy, and compare their reports with what is true."""
    wrong: list[str] = []
    with running_server() as server, _peak(server) as peak:
        for number in range(seed, seed + missions):
            with UnreliableProxy(server.port, _SHARE, number) as proxy:
                begun = time.monotonic()
                ended, team, faults = run(f"http://127.0.0.1:{proxy.port}", number, killed=server)
                seconds = time.monotonic() - begun
                wrong += [f"{number}: {fault}" for fault in faults]
                told = ", ".join(f"{count} {what}" for what, count in sorted(proxy.injected.items()))
                say(f"{FLEET}: {ended.status} after {seconds:.0f} s: {ended.reason}")
                yield TrialRow(
                    part=FLEET,
                    requirement=f"a mission of {len(team.robots)} robots with all faults ends behind a bad proxy",
                    figure=f"{ended.status} after {ended.t_ms / 1000:.0f} s of mission time, {seconds:.0f} s, "
                    f"{team.reports} reports, {proxy.requests} requests: {told}",
                    goal="as the operator says",
                    judgement=judged(ended.status is (Status.CANCELLED if number % 2 else Status.COMPLETE)),
                    values={"requests": proxy.requests, "reports": team.reports, "seconds": seconds, **proxy.injected},
                )
    said = "".join(f"; {fault}" for fault in wrong[:5])
    yield none_of(FLEET, "parts of the reports of ends that are not true", len(wrong), said)
    yield TrialRow(
        part=FLEET, requirement="most memory of the service, with all its processes", figure=f"{peak[0]} MiB"
    )


@contextmanager
def _peak(server: TrialServer) -> Iterator[list[int]]:
    """Yield a list with the most memory in MiB that the processes of a server have had so far."""
    most, over = [0], threading.Event()

    def look() -> None:
        while not over.wait(_LOOK_S):
            most[0] = max(most[0], reaper.resident_bytes([server.process.pid, *server.below()]) >> 20)

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield most
    finally:
        over.set()
        thread.join()


def _restart(server: Server) -> None:
    server.kill()
    server.launch()


def _scenario(name: str, seed: int, carriers: int) -> tuple[Scenario, tuple[PlacedRobot, ...]]:
    """Return a scenario with batteries that bind, and its team; the first carriers start at charging places."""
    scenario = builtin_scenario(name, carriers, _ROVERS)
    kinds = [replace(kind, battery=_BATTERIES[kind.role]) for kind in scenario.robot_types]
    coverage = 1.0 if seed % 2 else _ENOUGH
    scenario = replace(scenario, robot_types=tuple(kinds), limits=replace(scenario.limits, coverage=coverage))
    placed = place_team(scenario, seed)
    starts = [robot.cell for robot in placed if robot.cell is not None]
    return replace(scenario, grid=replace(scenario.grid, chargers=tuple(starts[:_CHARGERS]))), placed


def _faults(grid: Grid, names: Collection[str]) -> list[Fault]:
    """Return the faults of robots of these names, and of ground on this map."""
    return [
        fault
        for fault in _FAULTS
        if (fault.robot is None or fault.robot in names)
        and (fault.area is None or all(grid.contains(cell) for cell in fault.area))
    ]


def run(
    url: str,
    seed: int,
    scenario_name: str = "maze",
    carriers: int = _CARRIERS,
    killed: Server | None = None,
) -> tuple[MissionEnded, TruthfulTeam, list[str]]:
    """Run a mission of the service at a URL; return its end, the team, and what the report of the end gets wrong.

    The service `killed` is killed and started anew in between.
    """
    scenario, placed = _scenario(scenario_name, seed, carriers)
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
    faults = _faults(scenario.grid, {robot.name for robot in placed})
    team = TruthfulTeam(scenario.grid, kinds, placed, faults, scenario.limits.time_ms, seed)
    acts = list(_ACTS)
    if killed is not None:
        acts += [(at_s, lambda _: _restart(killed)) for at_s in _KILLED_S]
    if seed % 2:
        acts.append((_WOUND_DOWN_S, lambda mission: mission.wind_down()))
    lost: set[str] = set()
    ended: MissionEnded | None = None
    decoder = LogDecoder()
    with Client(url, patience_s=_PATIENCE_S) as client:
        mission = client.begin(cast(Brief, asked))
        operator = Operator(url, mission.id, acts)
        for event in mission.events():
            if event.type == "log":
                match decoder.event(event.data):
                    case RobotLost() as logged:
                        lost.add(logged.robot)
                    case RobotReturned() as logged:
                        lost.discard(logged.robot)
                    case MissionEnded() as logged:
                        ended = logged
            elif event.type == "state":
                team.paused = event.data["state"] == "paused"
            elif event.type == "commands":
                report = team.answer(event.data)
                if report is not None:
                    mission.report(cast(News, report))
                    team.reports += 1
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
    out = [r.name for r in team.robots if roles[r.type] is Role.ROVER and r.carrier is None]
    named = [name for name in out if name in ended.reason]
    named = out if ended.status is Status.STALLED else named  # the reason then says what else hinders them
    if out != named or ("all rovers are aboard" in ended.reason and out) or set(ended.lost) != lost:
        yield f"not aboard are {out}: {ended.reason}"
    for x, y in (left.cell for left in ended.remaining):
        if not (cells[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3] == UNKNOWN).any():
            yield f"the frontier at {(x, y)} is none"
