"""What the service knows of a mission while its process thinks: enough to judge a report the moment it comes.

A report is judged by what its client knew: every command that was published and has not ended may end, whatever else
has happened to its robots; a robot is lost once the client has said so. A state is made again from what is stored,
commands before reports.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from marsupial.errors import Problem
from marsupial.formats.fields import Notes
from marsupial.model.grid import CellArray
from marsupial.model.mission import ActionEnd
from marsupial.model.runs import cells_in
from marsupial.model.team import Whereabouts
from marsupial_service.missions.frames import MissionFrame
from marsupial_service.missions.reported import ReportedMap, ReportedRobot, ReportedTeam, RobotCommand
from marsupial_service.missions.values import MissionBrief, MissionReport, StoredEvent
from marsupial_service.schemas.words import EventType

_GROUND = "ground"
"""Where a robot is that is not aboard: its client knows the cell."""


class ReportConflict(Exception):
    """A report contradicts what is known; `problems` say where."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = problems


class MissionState:
    """The state of one mission as its client sees it."""

    def __init__(self, brief: MissionBrief) -> None:
        self.n = 0
        self.t_ms = 0
        self.revision = 0
        self.map = ReportedMap(brief.grid.cells.copy(), MissionFrame.of(brief.grid))
        self._told_ms: dict[str, int] = {}
        self._team = ReportedTeam(
            {
                robot.name: ReportedRobot(Whereabouts(_GROUND if robot.cell is not None else None, robot.carrier))
                for robot in brief.robots
            }
        )
        self._digests: dict[str | None, list[bytes]] = {None: []}

    @property
    def frame(self) -> MissionFrame:
        """The frame of the map."""
        return self.map.frame

    @property
    def cells(self) -> CellArray:
        """The known cells of the map, shape (height, width)."""
        return self.map.cells

    @property
    def counts(self) -> dict[str, int]:
        """The last report of each robot that has reported by its own count."""
        return {robot: len(digests) for robot, digests in self._digests.items() if robot is not None}

    def copy(self) -> MissionState:
        """Return a copy to try reports on."""
        other = copy.copy(self)
        other.map, other._team, other._told_ms = self.map.copy(), self._team.copy(), dict(self._told_ms)
        other._digests = {robot: list(digests) for robot, digests in self._digests.items()}
        return other

    def is_repeat(self, n: int, digest: bytes, robot: str | None = None) -> bool:
        """Return whether a report (of the team, or a robot's own) was taken before.

        Raises ReportConflict if another one was, or one is missing before it.
        """
        digests = self._digests.get(robot, [])
        if n == len(digests) + 1:
            return False
        if n > len(digests):
            whose = "" if robot is None else f" of {robot}"
            said = f"must be {len(digests) + 1}, the number after the last report{whose}, got {n}"
            raise ReportConflict(Problem("n", said))
        if digests[n - 1] != digest:
            raise ReportConflict(Problem("n", f"report {n} was another one"))
        return True

    def check(self, report: MissionReport, most_cells: float = math.inf) -> None:
        """Raise ReportConflict if `report` can't be true after all that was reported, or makes the map too large."""
        problems = tuple(self._faults(report))
        size = self.map.frame_with(report).size
        if size > most_cells:
            said = f"the map of the mission would have {size} cells, more than the limit of {most_cells:g}"
            problems += (Problem("frame", said),)
        if problems:
            raise ReportConflict(*problems)

    def take(self, report: MissionReport, digest: bytes) -> None:
        """Enter a report that was checked."""
        self._digests.setdefault(report.robot, []).append(digest)
        self.t_ms = max(self.t_ms, report.t_ms)
        if report.robot is None:
            self.n = report.n
        else:
            self._told_ms[report.robot] = report.t_ms
        self.map.grow(report)
        self.map.draw(report)
        for number in report.finished:
            self._team.end(number, ActionEnd.DONE)
        for number, _ in report.failed:
            self._team.end(number, ActionEnd.FAILED)
        for name, _ in report.lost:
            self._team.lose(name)

    def publish(self, event: StoredEvent) -> None:
        """Enter what the mission has told."""
        if event.type is EventType.COMMANDS:
            batch = json.loads(event.data)
            self.revision = batch["revision"]
            for command in batch["commands"]:
                self._order(command)

    def _order(self, command: Mapping[str, Any]) -> None:
        if command["name"] != "stop":  # which ends nothing by itself
            own = {key: command[key] for key in ("id", "name", "robot")}
            self._team.begin(RobotCommand(**own, carrier=command.get("carrier")), _GROUND)

    def _is_lost(self, name: str) -> bool:
        return self._team.robots[name].lost

    def _faults(self, report: MissionReport) -> Iterator[Problem]:
        last_ms = self.t_ms if report.robot is None else self._told_ms.get(report.robot, 0)
        if report.t_ms < last_ms:
            yield Problem("t_ms", f"must not go back, got {report.t_ms} after {last_ms}")
        if report.robot is not None and self._is_lost(report.robot):
            yield Problem("robot", f"{report.robot} is lost")
        ended = [(f"finished[{i}]", number) for i, number in enumerate(report.finished)]
        ended += [(f"failed[{i}].id", number) for i, (number, _) in enumerate(report.failed)]
        for path, number in ended:
            if number not in self._team.commands:
                yield Problem(path, f"command {number} was never given, or has ended")
        for i, number in enumerate(report.finished):
            command = self._team.commands.get(number)
            named = () if command is None else (command.robot, command.carrier)
            lost = [name for name in named if name is not None and self._is_lost(name)]
            if lost:
                yield Problem(f"finished[{i}]", f"{lost[0]} is lost and finishes nothing")
        for i, note in enumerate(report.robots):
            yield from self._robot_faults(f"robots[{i}]", note.name, note.cell is not None)
        for i, (name, _) in enumerate(report.revealed):
            if self._is_lost(name):
                yield Problem(f"revealed[{i}].robot", f"{name} is lost and sees nothing")
        yield from self._map_faults(report)

    def _robot_faults(self, path: str, name: str, placed: bool) -> Iterator[Problem]:
        if self._is_lost(name):
            yield Problem(f"{path}.name", f"{name} is lost")
        elif placed and (carrier := self._team.robots[name].where.aboard) is not None:
            yield Problem(path, f"{name} is aboard {carrier}")

    def _map_faults(self, report: MissionReport) -> Iterator[Problem]:
        if not report.revealed:
            return
        indices, codes = cells_in(report.runs)
        order = np.argsort(indices, kind="stable")
        indices, codes = indices[order], codes[order]
        if np.any((indices[1:] == indices[:-1]) & (codes[1:] != codes[:-1])):
            yield Problem("revealed", "two robots see one cell differently")


def new_reports(
    state: MissionState, sent: Sequence[tuple[MissionReport, bytes]], most_cells: float
) -> list[tuple[MissionReport, bytes]]:
    """Return the reports of a request, with their digests, that were not taken before.

    Several are entered in the state one after the other, as each is judged by those before it: let it be a copy. A
    single one is not. Raises ReportConflict, which in a batch says whose fault it is.
    """
    new: list[tuple[MissionReport, bytes]] = []
    for i, (report, digest) in enumerate(sent):
        try:
            if state.is_repeat(report.n, digest, report.robot):
                continue
            state.check(report, most_cells)
        except ReportConflict as error:
            if len(sent) == 1:
                raise
            notes = Notes(f"reports[{i}]")
            for one in error.problems:
                notes.wrong(one.path, one.message)
            raise ReportConflict(*notes.problems) from error
        if len(sent) > 1:
            state.take(report, digest)
        new.append((report, digest))
    return new
