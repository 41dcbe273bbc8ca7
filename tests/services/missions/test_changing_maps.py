"""Robots with their own reports on a changing, growing map: none drives into a reported obstacle."""

import json
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from mission_setup import Hosted, body, brief_from, replayed

from marsupial.formats.missionlog import parse_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.maps.discs import fits
from marsupial.mission.playback import Playback
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell, CellArray
from marsupial.model.mission import MissionEnded
from marsupial.model.missionframe import MissionFrame, embedded
from marsupial.model.runs import Runs, known_runs
from marsupial_service.missions.state import MissionState
from marsupial_service.missions.values import Control, MissionBatch, MissionBrief, MissionReport, PendingInput
from marsupial_service.schemas.enums import EventType

SIGHT = 6
"""Cells that a robot sees in each direction."""


def partial_brief(margin: int = 8) -> tuple[MissionBrief, CellArray, Cell]:
    """Return a mission in the part of the lobby around its team, the lobby's cells, and the part's corner."""
    asked = body("lobby")
    truth = builtin_scenario("lobby").grid.solid().cells
    starts = [robot["cell"] for robot in asked["team"] if "cell" in robot]
    corner = Cell(*(max(0, min(cell[axis] for cell in starts) - margin) for axis in (0, 1)))
    size = [min(truth.shape[1 - axis], max(c[axis] for c in starts) + margin) - corner[axis] for axis in (0, 1)]
    asked["frame"] |= {"width": size[0], "height": size[1], "origin_m": [3.7, -1.3, 0.4]}
    for robot in asked["team"]:
        if "cell" in robot:
            robot["cell"] = [robot["cell"][0] - corner.x, robot["cell"][1] - corner.y]
    del asked["area"]
    return brief_from(asked), truth, corner


@dataclass
class ReportingRobot:
    """The state of a robot on its own computer: its lattice cell and the rest of its drive."""

    at: Cell | None
    count: int = 0
    t_ms: int = 0
    drive: int | None = None
    way: list[Cell] = field(default_factory=list)
    stopped: bool = False


class RoamingTeam:
    """A team that executes commands; `report` returns the next report of one robot or of the team."""

    def __init__(self, brief: MissionBrief, truth: CellArray, corner: Cell, seed: int) -> None:
        self.draw = random.Random(seed)
        self.brief = brief
        self.truth, self.corner = truth, corner
        self.slam = truth.copy()
        self.state = MissionState(brief)
        self.last = self.state.map.cells.copy()
        self.robots = {robot.name: ReportingRobot(robot.cell) for robot in brief.robots}
        self.kinds = {robot.name: next(k for k in brief.kinds if k.name == robot.type) for robot in brief.robots}
        self.handovers: dict[int, tuple[str, str, Cell | None]] = {}
        self.frame = MissionFrame.of(brief.grid)
        self.now_ms = self.n = 0

    def obey(self, batch: MissionBatch) -> None:
        self.state.follow(batch.events, ())
        for event in batch.events:
            for command in json.loads(event.data)["commands"] if event.type == "commands" else ():
                self._obey(command)

    def _obey(self, command: Mapping[str, Any]) -> None:
        robot = self.robots[command["robot"]]
        if command["name"] == "stop":
            robot.stopped = True
        elif command["name"] == "drive":
            robot.drive, robot.stopped = command["id"], False
            frame = self.state.map.frame
            robot.way = [Cell(x + frame.x, y + frame.y) for x, y in command["route"]]
            assert robot.way[0] == robot.at
        else:
            frame, cell = self.state.map.frame, command.get("cell")
            put = None if cell is None else Cell(cell[0] + frame.x, cell[1] + frame.y)
            self.handovers[command["id"]] = (command["robot"], command["carrier"], put)

    def driving(self) -> Iterator[tuple[str, ReportingRobot]]:
        """Yield driving robots without a stop command."""
        for name, robot in self.robots.items():
            if robot.drive is not None and not robot.stopped:
                yield name, robot

    def apply_report(self, report: MissionReport) -> None:
        before = self.state.map.frame
        self.state.apply(report, b"")
        cells = self.state.map.cells
        self.last = np.where(cells == UNKNOWN, embedded(self.last, before, self.state.map.frame), cells)

    def blocked(self, name: str, *, lost: bool = True) -> bool:
        """Return whether, on the reported map, a robot can't stand on its route beyond its next cell.

        Both cells beside a diagonal step count. Lost cells block the route if `lost`, else they have their last code.
        """
        frame, way = self.state.map.frame, self.robots[name].way[1:]
        grid = frame.grid(self.brief.grid, self.state.map.cells if lost else self.last)
        corners = [(a.x, b.y) for a, b in pairwise(way)] + [(b.x, a.y) for a, b in pairwise(way)]
        ahead = [Cell(x, y) for x, y in {*way[1:], *corners} - set(way[:1])]
        return not fits(grid, self.kinds[name], *(Cell(x - frame.x, y - frame.y) for x, y in ahead))

    def report(self) -> MissionReport:
        """Advance one robot, or sometimes the team, and return its report."""
        team = self.draw.random() < 0.15
        names = list(self.robots) if team or not self.n else [self.draw.choice(list(self.robots))]
        self.now_ms += self.draw.choice([0, 100, 400])
        finished: list[int] = []
        for name in names:
            finished += self._advance(name)
        if self.n and self.draw.random() < 0.3:
            self._change_map(self.robots[names[0]])
        seen = [(name, self._view(self.robots[name].at)) for name in names if self.robots[name].at is not None]
        frame = self._frame_for([cells for _, cells in seen])
        notes = [self._position_update(name, frame) for name in names if self.robots[name].at is not None]
        robot = self.robots[names[0]]
        more: dict[str, Any] = {"n": robot.count + 1, "robot": names[0], "t_ms": max(robot.t_ms, self._delayed_ms())}
        if len(names) > 1:
            self.n += 1
            more = {"n": self.n, "t_ms": max(self.now_ms, self.state.t_ms)}
        else:
            robot.count, robot.t_ms = more["n"], more["t_ms"]
        revealed = {name: self._runs(cells, frame) for name, cells in seen}
        if len(names) > 1:  # they share one map
            revealed = dict(list(revealed.items())[:1])
        looks = [{"robot": name, "runs": runs} for name, runs in revealed.items()]
        return MissionReport(revealed=looks, robots=notes, finished=finished, frame=frame, **more)

    def _delayed_ms(self) -> int:
        """Return the time on a robot's clock, which is sometimes slightly late."""
        return max(0, self.now_ms - self.draw.choice([0, 0, 30, 300]))

    def _advance(self, name: str) -> list[int]:
        robot, over = self.robots[name], []
        if robot.drive is not None:
            steps = 1 if robot.stopped else self.draw.randint(1, 3)
            robot.way = robot.way[min(steps, len(robot.way) - 1) :]
            robot.at = robot.way[0]
            if robot.stopped or len(robot.way) == 1:
                over.append(robot.drive)
                robot.drive = None
        for number, (rover, carrier, put) in list(self.handovers.items()):
            if name in (rover, carrier) and self.draw.random() < 0.5:
                over.append(number)
                del self.handovers[number]
                self.robots[rover].at = put
        return over

    def _change_map(self, reporter: ReportingRobot) -> None:
        """Change some cells of the SLAM map, or restore their true codes; often ahead of the reporting robot."""
        height, width = self.slam.shape
        x, y = self.draw.randrange(width), self.draw.randrange(height)
        if reporter.drive is not None and self.draw.random() < 0.5:
            ahead = self.draw.choice(reporter.way[:SIGHT])
            x, y = max(0, ahead.x + self.corner.x), max(0, ahead.y + self.corner.y)
        part = slice(y, y + self.draw.randint(1, 3)), slice(x, x + self.draw.randint(1, 3))
        code = self.draw.choice([OBSTACLE, FLOOR, UNKNOWN, None, None])
        self.slam[part] = self.truth[part] if code is None else code

    def _view(self, at: Cell | None) -> MissionFrame:
        return MissionFrame(at.x - SIGHT, at.y - SIGHT, 2 * SIGHT + 1, 2 * SIGHT + 1)

    def _frame_for(self, views: list[MissionFrame]) -> MissionFrame:
        """Return a frame that contains these views: the mission's frame as known so far, or the smallest one."""
        frame = views[0] if views and self.draw.random() < 0.3 else self.frame
        for view in views:
            frame = frame.grown(view)
        self.frame = self.frame.grown(frame)
        return frame

    def _runs(self, view: MissionFrame, frame: MissionFrame) -> Runs:
        """Return the runs of a view in a frame; unknown cells have the code of lost ones."""
        cells = np.full((view.height, view.width), OBSTACLE, dtype=np.uint8)
        x, y = view.x + self.corner.x, view.y + self.corner.y
        low, left = max(0, y), max(0, x)
        part = self.slam[low : max(low, y + view.height), left : max(left, x + view.width)]
        cells[low - y : low - y + part.shape[0], left - x : left - x + part.shape[1]] = part
        cells[cells == UNKNOWN] = 254  # `known_runs` omits unknown cells
        runs = list(known_runs(embedded(cells, view, frame)))
        runs[2::3] = [UNKNOWN if code == 254 else code for code in runs[2::3]]
        return tuple(runs)

    def _position_update(self, name: str, frame: MissionFrame) -> dict[str, Any]:
        """Return where a robot is, or where it would stop."""
        robot = self.robots[name]
        assert robot.at is not None
        cell = robot.way[1] if robot.drive is not None else robot.at
        return {"name": name, "cell": Cell(cell.x - frame.x, cell.y - frame.y)}


SEEDS = [1, 2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 40))]


def run_mission(team: RoamingTeam, most: int = 150) -> tuple[list[MissionReport | Control], list[MissionBatch]]:
    """Run a mission and check each batch; return all inputs and batches."""
    inputs: list[MissionReport | Control] = []
    with Hosted(team.brief) as hosted:
        batches = [hosted.batch(PendingInput(input=None))]
        team.obey(batches[-1])
        while not batches[-1].over:
            going = {name for name, _ in team.driving()}
            report = team.report()
            team.state.check(report)
            team.apply_report(report)
            blocked = {name for name, _ in team.driving() if name in going and team.blocked(name)}
            inputs.append(report if len(batches) < most else Control.CANCEL)
            batches.append(hosted.batch(PendingInput(input=inputs[-1])))
            team.obey(batches[-1])
            if not batches[-1].over:
                check_batch(team, batches[-1], going, blocked)
    return inputs, batches


def check_batch(team: RoamingTeam, batch: MissionBatch, going: set[str], blocked: set[str]) -> None:
    """Check that no robot drives on to where it can't stand, and that only such robots stop without a new plan.

    Repeatedly lost cells block no robot unless they blocked it before.
    """
    assert not [name for name, _ in team.driving() if team.blocked(name, lost=False)]
    stopped = {name for name in going if team.robots[name].stopped}
    planned = any(e.type is EventType.LOG and e.data.startswith('{"event":"plan"') for e in batch.events)
    assert planned or stopped <= blocked


@pytest.mark.parametrize("seed", SEEDS)
def test_no_robot_drives_into_an_obstacle_and_the_log_continues_however_the_map_changes(seed: int) -> None:
    team = RoamingTeam(*partial_brief(), seed)
    inputs, batches = run_mission(team)
    lines = [event.data for batch in batches for event in batch.events if event.type is EventType.LOG]
    log = parse_log("".join(f"{line}\n" for line in lines).encode())
    assert isinstance(log.events[-1], MissionEnded)
    kinds = {json.loads(line)["event"] for line in lines}
    assert {"change", "frame", "drive", "plan"} <= kinds
    assert np.array_equal(Playback(log.events).cells_at(log.events[-1].t_ms), stored_map(team, inputs))
    assert replayed(team.brief, inputs, batches) == batches


def stored_map(team: RoamingTeam, inputs: list[MissionReport | Control]) -> np.ndarray:  # type: ignore[type-arg]
    """Return the map of a state rebuilt from the stored inputs."""
    state = MissionState(team.brief)
    for one in inputs:
        if isinstance(one, MissionReport):
            state.map.grow(one)
            state.map.draw(one)
    return state.map.cells
