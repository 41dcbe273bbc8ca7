"""What the service knows of a mission while its process thinks: enough to judge a report the moment it comes.

A report is judged by what its client knew: every command that was published and has not ended may end, whatever else
has happened to its robots; a robot is lost once the client has said so. A ledger is made again from what is stored,
commands before reports.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from marsupial.errors import Problem
from marsupial.model.grid import UNKNOWN, CellArray
from marsupial.model.mission import ActionEnd
from marsupial.model.plan import ActionName
from marsupial.model.team import Whereabouts
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
        self._open: dict[int, _Order] = {}
        self._lost: set[str] = set()
        self._where = {
            robot.name: Whereabouts(_GROUND if robot.cell is not None else None, robot.carrier)
            for robot in brief.robots
        }
        self._digests: list[bytes] = []

    def is_repeat(self, n: int, digest: bytes) -> bool:
        """Say whether a report was taken before. Raises Conflict if another one was, or one is missing before it."""
        if n == self.n + 1:
            return False
        if n > self.n:
            raise Conflict(Problem("n", f"must be {self.n + 1}, the number after the last report, got {n}"))
        if self._digests[n - 1] != digest:
            raise Conflict(Problem("n", f"report {n} was another one"))
        return True

    def check(self, report: Report) -> None:
        """Raise Conflict if `report` can't be true after all that was reported."""
        problems = tuple(self._faults(report))
        if problems:
            raise Conflict(*problems)

    def take(self, report: Report, digest: bytes) -> None:
        """Enter a report that was checked."""
        self.n, self.t_ms = report.n, report.t_ms
        self._digests.append(digest)
        flat = self.cells.reshape(-1)
        for _, runs in report.revealed:
            indices, codes = expand(runs)
            flat[indices] = codes
        if report.map is not None:
            self.cells = report.map.copy()
        for number in report.finished:
            order = self._open.pop(number)
            if len(order.robots) == 2:
                begun = order.begun(self._where[order.robots[0]])
                self._where[order.robots[0]] = begun.ended(ActionName(order.name), ActionEnd.DONE)
        for number, _ in report.failed:
            del self._open[number]
        for name, _ in report.lost:
            self._lose(name)

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
        if report.t_ms < self.t_ms:
            yield Problem("t_ms", f"must not go back, got {report.t_ms} after {self.t_ms}")
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
        pieces = [expand(runs) for _, runs in report.revealed]
        flat = self.cells.reshape(-1)
        for i, (indices, codes) in enumerate(pieces):
            known = flat[indices]
            wrong = indices[(known != UNKNOWN) & (known != codes)]
            if len(wrong):
                text = f"cell {wrong[0]} is known to be {flat[wrong[0]]}; a changed map is reported whole, as map"
                yield Problem(f"revealed[{i}].runs", text)
        indices, codes = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        order = np.argsort(indices, kind="stable")
        indices, codes = indices[order], codes[order]
        if np.any((indices[1:] == indices[:-1]) & (codes[1:] != codes[:-1])):
            yield Problem("revealed", "two robots see one cell differently")
