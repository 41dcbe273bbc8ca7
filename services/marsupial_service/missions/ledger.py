"""What the service knows of a mission while its process thinks: enough to judge a report the moment it comes.

A report is judged by what its client knew: every command that was published and has not ended may end, whatever else
has happened to its robots; a robot is lost once the client has said so. A ledger is made again from what is stored,
commands before reports.
"""

from __future__ import annotations

import copy
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from marsupial.errors import Problem
from marsupial.formats.fields import Notes
from marsupial.model.grid import CellArray
from marsupial.model.mission import ActionEnd
from marsupial.model.plan import ActionName
from marsupial.model.team import Whereabouts
from marsupial_service.missions.frames import Frame, laid_out, placed
from marsupial_service.missions.values import Brief, Event, EventType, Report, expand

_GROUND = "ground"
"""Where a robot is that is not aboard: its client knows the cell."""


class Conflict(Exception):
    """A report contradicts what is known; `problems` say where."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = problems


@dataclass(frozen=True, slots=True)
class _Order:
    name: str
    robots: tuple[str, ...]

    def begun(self, where: Whereabouts[str]) -> Whereabouts[str]:
        """Return where the rover of a docking or undocking is from its beginning."""
        return where.begun(ActionName(self.name), _GROUND, self.robots[1])


class Ledger:
    """The state of one mission as its client sees it."""

    def __init__(self, brief: Brief) -> None:
        self.n = 0
        self.t_ms = 0
        self.revision = 0
        self.cells: CellArray = brief.grid.cells.copy()
        self.first_frame = self.frame = Frame.of(brief.grid)
        self._told_ms: dict[str, int] = {}
        self._open: dict[int, _Order] = {}
        self._lost: set[str] = set()
        self._where = {
            robot.name: Whereabouts(_GROUND if robot.cell is not None else None, robot.carrier)
            for robot in brief.robots
        }
        self._digests: dict[str | None, list[bytes]] = {None: []}

    @property
    def counts(self) -> dict[str, int]:
        """The last report of each robot that has reported by its own count."""
        return {robot: len(digests) for robot, digests in self._digests.items() if robot is not None}

    def copy(self) -> Ledger:
        """Return a ledger to try reports on."""
        other = copy.copy(self)
        other.cells = self.cells.copy()
        other._told_ms, other._open, other._where = dict(self._told_ms), dict(self._open), dict(self._where)
        other._lost = set(self._lost)
        other._digests = {robot: list(digests) for robot, digests in self._digests.items()}
        return other

    def is_repeat(self, n: int, digest: bytes, robot: str | None = None) -> bool:
        """Say whether a report (of the team, or a robot's own) was taken before.

        Raises Conflict if another one was, or one is missing before it.
        """
        digests = self._digests.get(robot, [])
        if n == len(digests) + 1:
            return False
        if n > len(digests):
            whose = "" if robot is None else f" of {robot}"
            said = f"must be {len(digests) + 1}, the number after the last report{whose}, got {n}"
            raise Conflict(Problem("n", said))
        if digests[n - 1] != digest:
            raise Conflict(Problem("n", f"report {n} was another one"))
        return True

    def check(self, report: Report, most_cells: float = math.inf) -> None:
        """Raise Conflict if `report` can't be true after all that was reported, or the map would get too large."""
        problems = tuple(self._faults(report))
        size = self._frame_with(report).size
        if size > most_cells:
            said = f"the map of the mission would have {size} cells, more than the limit of {most_cells:g}"
            problems += (Problem("frame", said),)
        if problems:
            raise Conflict(*problems)

    def take(self, report: Report, digest: bytes) -> None:
        """Enter a report that was checked."""
        self._digests.setdefault(report.robot, []).append(digest)
        self.t_ms = max(self.t_ms, report.t_ms)
        if report.robot is None:
            self.n = report.n
        else:
            self._told_ms[report.robot] = report.t_ms
        self.draw(report)
        for number in report.finished:
            order = self._open.pop(number)
            if len(order.robots) == 2:
                begun = order.begun(self._where[order.robots[0]])
                self._where[order.robots[0]] = begun.ended(ActionName(order.name), ActionEnd.DONE)
        for number, _ in report.failed:
            del self._open[number]
        for name, _ in report.lost:
            self._lose(name)

    def _frame_with(self, report: Report) -> Frame:
        """Return the frame of the mission after a report."""
        return self.frame if report.frame is None else self.frame.grown(report.frame)

    def draw(self, report: Report) -> None:
        """Enter what a report says of the map."""
        before, self.frame = self.frame, self._frame_with(report)
        self.cells = laid_out(self.cells, before, self.frame)
        of = report.frame or self.first_frame
        flat = self.cells.reshape(-1)
        if report.revealed:
            indices, codes = expand(report.runs)
            flat[placed(indices, of, self.frame)] = codes
        if report.map is not None:
            self.cells = laid_out(report.map.copy(), of, self.frame)

    def publish(self, event: Event) -> None:
        """Enter what the mission has told."""
        if event.type is EventType.COMMANDS:
            batch = json.loads(event.data)
            self.revision = batch["revision"]
            for command in batch["commands"]:
                self._order(command)

    def _order(self, command: Mapping[str, object]) -> None:
        if command["name"] != "stop":  # which ends nothing by itself
            robots = tuple(str(command[role]) for role in ("robot", "carrier") if role in command)
            self._open[int(str(command["id"]))] = _Order(str(command["name"]), robots)

    def _lose(self, name: str) -> None:
        self._lost |= {name} | {rover for rover in self._where if self._aboard(rover) == name}

    def _aboard(self, name: str) -> str | None:
        """Return the carrier that a robot is aboard, as far as its client knows."""
        where = self._where[name]
        for order in self._open.values():
            if order.robots[0] == name and len(order.robots) == 2:
                where = order.begun(where)
        return where.aboard

    def _faults(self, report: Report) -> Iterator[Problem]:
        last_ms = self.t_ms if report.robot is None else self._told_ms.get(report.robot, 0)
        if report.t_ms < last_ms:
            yield Problem("t_ms", f"must not go back, got {report.t_ms} after {last_ms}")
        if report.robot in self._lost:
            yield Problem("robot", f"{report.robot} is lost")
        ended = [(f"finished[{i}]", number) for i, number in enumerate(report.finished)]
        ended += [(f"failed[{i}].id", number) for i, (number, _) in enumerate(report.failed)]
        for path, number in ended:
            if number not in self._open:
                yield Problem(path, f"command {number} was never given, or has ended")
        for i, number in enumerate(report.finished):
            lost = [name for name in self._open.get(number, _Order("", ())).robots if name in self._lost]
            if lost:
                yield Problem(f"finished[{i}]", f"{lost[0]} is lost and finishes nothing")
        for i, note in enumerate(report.robots):
            yield from self._robot_faults(f"robots[{i}]", note.name, note.cell is not None)
        for i, (name, _) in enumerate(report.revealed):
            if name in self._lost:
                yield Problem(f"revealed[{i}].robot", f"{name} is lost and sees nothing")
        yield from self._map_faults(report)

    def _robot_faults(self, path: str, name: str, placed: bool) -> Iterator[Problem]:
        if name in self._lost:
            yield Problem(f"{path}.name", f"{name} is lost")
        elif placed and (carrier := self._aboard(name)) is not None:
            yield Problem(path, f"{name} is aboard {carrier}")

    def _map_faults(self, report: Report) -> Iterator[Problem]:
        if not report.revealed:
            return
        indices, codes = expand(report.runs)
        order = np.argsort(indices, kind="stable")
        indices, codes = indices[order], codes[order]
        if np.any((indices[1:] == indices[:-1]) & (codes[1:] != codes[:-1])):
            yield Problem("revealed", "two robots see one cell differently")


def new_reports(ledger: Ledger, sent: Sequence[tuple[Report, bytes]], most_cells: float) -> list[tuple[Report, bytes]]:
    """Return the reports of a request, with their digests, that were not taken before.

    Several are entered in the ledger one after the other, as each is judged by those before it: let it be a copy. A
    single one is not. Raises Conflict, which in a batch says whose fault it is.
    """
    new: list[tuple[Report, bytes]] = []
    for i, (report, digest) in enumerate(sent):
        try:
            if ledger.is_repeat(report.n, digest, report.robot):
                continue
            ledger.check(report, most_cells)
        except Conflict as error:
            if len(sent) == 1:
                raise
            notes = Notes(f"reports[{i}]")
            for one in error.problems:
                notes.wrong(one.path, one.message)
            raise Conflict(*notes.problems) from error
        if len(sent) > 1:
            ledger.take(report, digest)
        new.append((report, digest))
    return new
