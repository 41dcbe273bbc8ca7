"""Missions of teams that report their map themselves, run in this process through the service's own mission loop.

The robots are simulated and get the commands of the mission; a distortion lies between what they see and what is
reported (`distortion`). Reports have the form of request bodies, and pass the checks of those.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from benchmarks.storm.account import ReportedMission
from benchmarks.storm.distortion import Distortion, Mapper, ReportedPicture
from benchmarks.storm.ground import Document
from benchmarks.storm.logs import Cell
from marsupial.formats.mapfiles.masks import FilterMasks
from marsupial.formats.mapfiles.occupancy import FREE_THRESH, OCCUPIED_THRESH, Occupancy
from marsupial.library.missions import reachable_area
from marsupial.model import Cell as MapCell
from marsupial.model import Scenario
from marsupial.model.faults import Fault, FaultKind
from marsupial.model.grid import CellArray
from marsupial.model.mission import PlacedRobot
from marsupial.model.missionframe import MissionFrame
from marsupial.model.runs import known_runs
from marsupial.processes.channel import Channel
from marsupial_ros.map_tracker import MapTracker
from marsupial_service.intake.missions import brief_of, report_of
from marsupial_service.missions.process import run_mission
from marsupial_service.missions.simulated import SimulatedTeam, mission_document
from marsupial_service.missions.values import Control, Input, MissionBatch, MissionTask, PendingInput, PlanningSignal
from marsupial_service.schemas.enums import EventType
from marsupial_service.schemas.missions import MissionBody, ReportBody
from marsupial_service.settings import ServiceLimits

MOST_REPORTS = 20_000
"""Missions of these sizes end within a few thousand reports."""


class DoesNotEnd(Exception):
    """A mission has had more reports than any needs."""


class ReportingTeam:
    """Runs a mission of a scenario; its operator may call the team back after some reports.

    Parameters
    ----------
    called_back
        After how many reports; None: never.
    """

    def __init__(
        self,
        scenario: Scenario,
        placed: tuple[PlacedRobot, ...],
        distortion: Distortion,
        how: Document,
        called_back: int | None,
    ) -> None:
        self._resolution_m, (self._height, self._width) = scenario.grid.resolution_m, scenario.grid.cells.shape
        self._distortion, self._open, self._called_back = distortion, distortion.frame != "whole", called_back
        kinds = {kind.name: kind for kind in scenario.robot_types}
        # a change that never comes makes robots look whether there is ground ahead of them, as real ones do
        never = Fault(
            kind=FaultKind.GROUND, area=(MapCell(0, 0), MapCell(0, 0)), terrain=0, at_ms=scenario.limits.time_ms + 1
        )
        faults, seed = [*scenario.faults, never], how["seed"]
        self._team = _Team(scenario.grid.solid(), kinds, placed, faults, scenario.limits.time_ms, seed)
        self._bodies = {r.name: kinds[r.type].radius_m / self._resolution_m for r in placed}
        self._near = np.zeros(scenario.grid.cells.shape, dtype=bool)
        self._stood: list[tuple[int, str, Cell]] = []
        for robot in placed:
            self._stand(0, robot.name, robot.cell)
        asked = mission_document(scenario, placed, reachable_area(scenario, placed), **how)
        self._corner = self._reframe(asked, placed) if self._open else (0, 0)
        self._brief = brief_of(MissionBody.model_validate(asked), ServiceLimits(), {})
        self._frame = MissionFrame.of(self._brief.grid)
        self._mapper, self._picture = Mapper(distortion), ReportedPicture((0, 0), np.zeros((0, 0), dtype=np.uint8))
        self._tracker = self._new_tracker() if distortion.shifts else None
        self._lines: list[str] = []
        self._reports = 0

    def run(self) -> ReportedMission:
        """Run the mission to its end."""
        run_mission(MissionTask(self._brief, self._brief.planner), cast(Channel, _Line(self._answer)))
        return ReportedMission(
            lines=self._lines,
            distortion=self._distortion,
            called_back=self._called_back is not None,
            corner=self._corner,
            open_edges=self._open,
            known=self._team.known,
            stood=self._stood,
            last=self._picture,
            driven=self._team.driven(),
        )

    def _reframe(self, asked: Document, placed: tuple[PlacedRobot, ...]) -> Cell:
        """Begin with a small frame around the team; return its corner."""
        rows, columns = np.nonzero(self._near)
        cells = [tuple(charger["cell"]) for charger in asked.get("chargers", [])]
        x, y = (min([int(along.min()), *(cell[i] for cell in cells)]) for i, along in ((0, columns), (1, rows)))
        right, high = (max([int(along.max()), *(cell[i] for cell in cells)]) for i, along in ((0, columns), (1, rows)))
        origin_m = [x * self._resolution_m, y * self._resolution_m, 0.0]
        asked["frame"] |= {"width": right + 1 - x, "height": high + 1 - y, "origin_m": origin_m}
        for one in (*asked["team"], *asked.get("chargers", [])):
            if "cell" in one:
                one["cell"] = [one["cell"][0] - x, one["cell"][1] - y]
        del asked["area"], asked["map_may_grow"]
        return x, y

    def _new_tracker(self) -> MapTracker:
        """Return a tracker of a map from ROS that goes on with the first frame."""
        tracker = MapTracker((), FilterMasks(), FREE_THRESH, OCCUPIED_THRESH)
        grid = self._brief.grid
        x, y, yaw = grid.origin_m
        tracker.expect(
            {"width": grid.width, "height": grid.height, "resolution_m": grid.resolution_m, "origin_m": [x, y, yaw]}
        )
        tracker.resume({"width": grid.width, "height": grid.height, "origin_m": [x, y, yaw], "runs": []})  # type: ignore[typeddict-item]
        return tracker

    def _answer(self, batch: MissionBatch) -> Input | None:
        """Carry out a batch of commands; return what happens next, None if the mission is over."""
        commands: Document = {}
        for event in batch.events:
            if event.type is EventType.LOG:
                self._lines += event.data.splitlines()
            elif event.type is EventType.FRAME:
                self._grow(json.loads(event.data))
            elif event.type is EventType.COMMANDS:
                commands = json.loads(event.data)
        if batch.over:
            return None
        self._reports += 1
        if self._reports > MOST_REPORTS:
            raise DoesNotEnd(f"the mission has had {MOST_REPORTS} reports")
        for command in commands["commands"]:
            for key in ("route", "cell"):
                if key in command:
                    command[key] = self._true_cells(command[key]) if key == "route" else self._true_cell(command[key])
        if self._reports == self._called_back:
            self._team.answer(commands | {"until_ms": None})
            return Control.WIND_DOWN
        report = self._team.answer(commands)
        assert report is not None
        sent = ReportBody.model_validate(self._distorted(report))
        return report_of(sent, self._brief, self._frame, self._height * self._width * 4)

    def _distorted(self, report: Document) -> Document:
        """Return a report with the distorted map, and places as cells of it."""
        for note in report["robots"]:
            self._stand(report["t_ms"], note["name"], note.get("cell"))
        picture = self._picture = self._mapper.picture(self._team.known, report["t_ms"], self._near)
        (x, y), (height, width) = picture.corner, picture.cells.shape
        del report["revealed"]
        if self._tracker is not None:
            return self._as_from_ros(report, self._tracker)
        origin_m = [x * self._resolution_m, y * self._resolution_m, 0.0]
        report["frame"] = {"width": width, "height": height, "origin_m": origin_m}
        report["map"] = {"runs": list(known_runs(picture.cells))}
        for note in report["robots"]:
            if "cell" in note:
                note["cell"] = [note["cell"][0] - x, note["cell"][1] - y]
        return report

    def _as_from_ros(self, report: Document, tracker: MapTracker) -> Document:
        """Add the map to a report as the bridge to ROS does, on a lattice of its own."""
        picture, metre = self._picture, 1 / self._resolution_m
        values = np.choose(np.minimum(picture.cells, 2), [100, 0, -1]).astype(np.int8)
        x, y = ((cell + part) * self._resolution_m for cell, part in zip(picture.corner, picture.shift, strict=True))
        tracker.take(Occupancy(values=values, resolution_m=self._resolution_m, origin_m=(x, y, 0.0)))
        frame, revealed = tracker.changes(self._team.places_m(metre))
        report["revealed"] = revealed
        if frame is not None:
            report["frame"] = frame
        for note in report["robots"]:
            if "cell" in note:
                note["pose_m"] = [(along + 0.5) / metre for along in note.pop("cell")]
        return report

    def _stand(self, t_ms: int, name: str, cell: Any) -> None:
        """Note where a robot is; the map is reported there, whatever sensors hit."""
        if cell is None:
            return
        (x, y), reach = cell, int(self._bodies[name]) + 2
        self._stood.append((t_ms, name, (x, y)))
        self._near[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1] = True

    def _grow(self, event: Document) -> None:
        x, y = event["shift"]
        self._frame = MissionFrame(self._frame.x - x, self._frame.y - y, event["width"], event["height"])

    def _true_cell(self, cell: list[int]) -> list[int]:
        return [cell[0] + self._corner[0] + self._frame.x, cell[1] + self._corner[1] + self._frame.y]

    def _true_cells(self, cells: list[list[int]]) -> list[list[int]]:
        return [self._true_cell(cell) for cell in cells]


class _Team(SimulatedTeam):
    """Simulated robots, and what they have seen."""

    @property
    def known(self) -> CellArray:
        return self._world.grid.cells

    def driven(self) -> dict[str, tuple[float, int]]:
        names = [robot.name for robot in self._world.robots()]
        return {name: (self._world.distance_m(name), self._world.driving_ms(name)) for name in names}

    def places_m(self, metre: float) -> dict[str, tuple[float, float]]:
        """Return where robots on the ground are, in metres."""
        on_ground = ((robot.name, robot.cell) for robot in self._world.robots() if robot.cell is not None)
        return {name: ((cell.x + 0.5) / metre, (cell.y + 0.5) / metre) for name, cell in on_ground}


@dataclass
class _Line:
    """The channel of a mission's process to a client in the same process: each batch is answered when it is sent."""

    answer: Callable[[MissionBatch], Input | None]
    due: deque[Any] = field(default_factory=lambda: deque([(PendingInput(input=None),)]))

    def send(self, sent: Any) -> None:
        if sent is PlanningSignal.REQUESTED:
            self.due.append(PlanningSignal.ALLOWED)
        elif sent is not PlanningSignal.DONE:
            for batch in sent:
                self.due.append((PendingInput(input=self.answer(batch)),))

    def receive(self) -> Any:
        return self.due.popleft()
