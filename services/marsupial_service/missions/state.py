"""The service's own state of a mission: enough to check a report on arrival, even while the process plans.

A report is checked against what its client knew: every published command that has not ended may end, whatever else
has happened to its robots; a robot is lost once the client has reported that. A state is rebuilt from the store, each
batch of commands after the reports that it considered. Any server may receive reports of a mission, so a report is
checked within the transaction that stores it, after everything stored by other servers has been applied to the state.
"""

import json
import math
from collections import OrderedDict, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from marsupial.errors import Problem
from marsupial.formats.fields import Notes
from marsupial.model.mission import ActionEnd
from marsupial.model.missionframe import MissionFrame
from marsupial.model.runs import cells_in
from marsupial.model.team import Whereabouts
from marsupial.model.zones import DatedZone, ZoneChange
from marsupial_service.entries.records import is_replayed
from marsupial_service.missions import packed
from marsupial_service.missions.encoding import decode_brief, decode_input
from marsupial_service.missions.records import MissionRecord
from marsupial_service.missions.reported import ReportedMap, ReportedRobot, ReportedTeam, RobotCommand
from marsupial_service.missions.values import Control, Input, MissionBrief, MissionReport, StoredEvent, StoredReport
from marsupial_service.schemas.enums import EventType
from marsupial_service.store import packing
from marsupial_service.store.transaction import StoreReader

# limit on the bytes of all cached maps
_MOST_CELLS = 200_000_000
# of the digest of an operator's request, those at its beginning that depend on the idempotency key alone
KEY_BYTES = 16
# inputs applied in one step: some 50 ms
_AT_A_TIME = 1000
# the place of a robot that is not aboard: only its client knows the cell
_GROUND = "ground"


class ReportConflict(Exception):
    """A report contradicts the state of the mission; `problems` say where."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__("; ".join(map(str, problems)))
        self.problems = problems


class MissionState:
    """The state of one mission as its client sees it."""

    def __init__(self, brief: MissionBrief) -> None:
        self.n = self.t_ms = self.revision = 0
        self.map = ReportedMap(brief.grid.cells.copy(), MissionFrame.of(brief.grid))
        self._robot_t_ms: dict[str, int] = {}
        self._team = ReportedTeam(
            {
                robot.name: ReportedRobot(Whereabouts(_GROUND if robot.cell is not None else None, robot.carrier))
                for robot in brief.robots
            },
            brief.kind_of,
        )
        self._digests: dict[str | None, list[bytes]] = {None: []}
        self._zones = {dated.name: dated for dated in brief.zones}
        self.winding_down = False
        self._asked: dict[bytes, bytes] = {}  # digests of the requests of operators, by those of their idempotency keys

    @property
    def counts(self) -> dict[str, int]:
        """The number of the last report of each robot that numbers its own reports."""
        return {robot: len(digests) for robot, digests in self._digests.items() if robot is not None}

    @property
    def zones(self) -> tuple[DatedZone, ...]:
        """The zones that hold or will."""
        return tuple(one for one in self._zones.values() if one.until_ms is None or one.until_ms > self.t_ms)

    def is_repeat(self, n: int, digest: bytes, robot: str | None = None) -> bool:
        """Return whether a report (of the team, or a robot's own) was accepted before.

        Raises ReportConflict if another report has this number, or an earlier number is missing.
        """
        digests = self._digests.get(robot, [])
        if n == len(digests) + 1:
            return False
        if n > len(digests):
            whose = "" if robot is None else f" of {robot}"
            text = f"must be {len(digests) + 1}, one more than the last report{whose}, got {n}"
            raise ReportConflict(Problem("n", text))
        if digests[n - 1] != digest:
            raise ReportConflict(Problem("n", f"report {n} was sent before with other content"))
        return True

    def check(self, report: MissionReport, most_cells: float = math.inf) -> None:
        """Raise ReportConflict if `report` contradicts earlier reports, or makes the map too large."""
        problems = tuple(self._faults(report))
        size = self.map.frame_with(report).size
        if size > most_cells:
            text = f"the map of the mission would have {size} cells, more than the limit of {most_cells:g}"
            problems += (Problem("frame", text),)
        if problems:
            raise ReportConflict(*problems)

    def apply(self, report: MissionReport, digest: bytes) -> None:
        """Apply a checked report."""
        self._digests.setdefault(report.robot, []).append(digest)
        self.t_ms = max(self.t_ms, report.t_ms)
        if report.robot is None:
            self.n = report.n
        else:
            self._robot_t_ms[report.robot] = report.t_ms
        self.map.grow(report)
        self.map.draw(report)
        for number in report.finished:
            self._team.end(number, ActionEnd.DONE)
        for ended in (*report.failed, *report.declined):
            self._team.end(ended.id, ActionEnd.FAILED)
        for lost in report.lost:
            self._team.mark_lost(lost.robot)
        for name in report.returned:
            self._team.mark_returned(name)

    def was_asked(self, digest: bytes | None) -> bool:
        """Return whether an operator's request of that digest (None: without a key) is a copy. Raises KeyReused."""
        return digest is not None and is_replayed(self._asked.get(digest[:KEY_BYTES]), digest)

    def changes(self, change: ZoneChange) -> bool:
        """Return whether a change of a zone would change anything."""
        now = self._zones.get(change.name)
        if change.zone is None or now is None:
            return change.zone is not now
        return now != DatedZone(name=change.name, zone=change.zone)

    def apply_wish(self, wish: Control | ZoneChange, digest: bytes | None = None) -> None:
        """Apply what an operator has asked for, in a request of that digest."""
        if digest is not None:
            self._asked[digest[:KEY_BYTES]] = digest
        if isinstance(wish, Control):
            self.winding_down = self.winding_down or wish is Control.WIND_DOWN
            return
        self._zones.pop(wish.name, None)
        if wish.zone is not None:
            self._zones[wish.name] = DatedZone(name=wish.name, zone=wish.zone)

    def follow(self, events: Iterable[StoredEvent], inputs: Iterable[tuple[Input, bytes | None]]) -> None:
        """Apply stored events, and inputs with their digests: commands come before the reports on them."""
        batches = deque(json.loads(event.data) for event in events if event.type is EventType.COMMANDS)
        for sent, digest in inputs:
            while batches and self._has_considered(batches[0]):
                self._begin(batches.popleft())
            if isinstance(sent, MissionReport):
                assert digest is not None, "reports are stored with their digest"
                self.apply(sent, digest)
            else:
                self.apply_wish(sent, digest)
        for batch in batches:
            self._begin(batch)

    def _has_considered(self, batch: Mapping[str, Any]) -> bool:
        """Return whether all reports have arrived that a batch of commands considered."""
        counts = {None: batch["n"], **batch.get("robots", {})}
        return all(len(self._digests.get(robot, ())) >= n for robot, n in counts.items())

    def _begin(self, batch: Mapping[str, Any]) -> None:
        self.revision = batch["revision"]
        for command in batch["commands"]:
            if command["name"] != "stop":  # a stop ends no command by itself
                own = {key: command[key] for key in ("id", "name", "robot")}
                self._team.begin(RobotCommand(**own, carrier=command.get("carrier")), _GROUND)

    def _is_lost(self, name: str) -> bool:
        return self._team.robots[name].lost

    def _faults(self, report: MissionReport) -> Iterator[Problem]:
        last_ms = self.t_ms if report.robot is None else self._robot_t_ms.get(report.robot, 0)
        if report.t_ms < last_ms:
            yield Problem("t_ms", f"must be at least {last_ms}, the time of the last report, got {report.t_ms}")
        back = frozenset(report.returned)
        if report.robot is not None and self._is_lost(report.robot) and report.robot not in back:
            yield Problem("robot", f"{report.robot} is lost")
        for path, number in report.ended():
            if number not in self._team.commands:
                yield Problem(path, f"command {number} is unknown or has ended")
        for i, number in enumerate(report.finished):
            command = self._team.commands.get(number)
            named = () if command is None else (command.robot, command.carrier)
            lost = [name for name in named if name is not None and self._is_lost(name)]
            if lost:
                yield Problem(f"finished[{i}]", f"{lost[0]} is lost and can't finish a command")
        for i, note in enumerate(report.robots):
            if self._is_lost(note.name) and note.name not in back:
                yield Problem(f"robots[{i}].name", f"{note.name} is lost")
            elif note.cell is not None and (carrier := self._team.robots[note.name].where.aboard) is not None:
                yield Problem(f"robots[{i}]", f"{note.name} is aboard {carrier}")
        for i, one in enumerate(report.out_of_contact):
            if self._is_lost(one.robot) and one.robot not in back:
                yield Problem(f"out_of_contact[{i}].robot", f"{one.robot} is lost")
            elif (carrier := self._team.robots[one.robot].where.aboard) is not None:
                yield Problem(f"out_of_contact[{i}].robot", f"{one.robot} is aboard {carrier}")
        for i, seen in enumerate(report.revealed):
            if self._is_lost(seen.robot) and seen.robot not in back:
                yield Problem(f"revealed[{i}].robot", f"{seen.robot} is lost and can't reveal cells")
        if report.revealed:
            indices, codes = cells_in(tuple(chain.from_iterable(seen.runs for seen in report.revealed)))
            order = np.argsort(indices, kind="stable")
            indices, codes = indices[order], codes[order]
            if np.any((indices[1:] == indices[:-1]) & (codes[1:] != codes[:-1])):
                yield Problem("revealed", "two robots report different codes for one cell")


def new_reports(state: MissionState, sent: Sequence[StoredReport], most_cells: float) -> list[StoredReport]:
    """Return the reports of a request, with their digests, that were not accepted before.

    Several reports are applied to `state` one by one, as each is checked after those before it: pass a copy. A single
    report is not applied. Raises ReportConflict, which in a batch names the faulty report.
    """
    new: list[StoredReport] = []
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
            state.apply(report, digest)
        new.append((report, digest))
    return new


@dataclass(slots=True)
class CachedState:
    """A state, and how many of the mission's inputs and batches it includes."""

    brief: MissionBrief
    state: MissionState
    inputs: int = 0
    batches: int = 0


class MissionStates:
    """A cache of the most recently used states. `brief` may be called by any thread, the rest by one."""

    def __init__(self) -> None:
        self._cache: OrderedDict[str, CachedState] = OrderedDict()

    def brief(self, mission: str) -> MissionBrief | None:
        """Return the brief of a mission, None if its state is not cached; any thread may call this."""
        cached = self._cache.get(mission)
        return None if cached is None else cached.brief

    def of(self, reader: StoreReader, record: MissionRecord) -> MissionState:
        """Return the state of a mission with everything stored applied; for a long mission this takes seconds."""
        while not self.advance(reader, record):
            pass
        # the latest one stays, however large it is
        while len(self._cache) > 1 and sum(one.state.map.cells.size for one in self._cache.values()) > _MOST_CELLS:
            self._cache.popitem(last=False)
        return self._cache[record.id].state

    def advance(self, reader: StoreReader, record: MissionRecord) -> bool:
        """Apply some more of what is stored to the state of a mission; return whether that was all."""
        cached = self._cache.get(record.id)
        if cached is None:
            found = brief(reader, record)
            cached = self._cache[record.id] = CachedState(found, MissionState(found))
        self._cache.move_to_end(record.id)
        inputs = min(cached.inputs + _AT_A_TIME, record.inputs)
        # batch k answers input k, so it comes after that input
        batches = min(inputs + 1, record.batches)
        if batches > cached.batches or inputs > cached.inputs:
            events = packed.events_of(reader, record.number, cached.batches, batches - 1)
            sent = packed.inputs_from(reader, record.number, cached.inputs + 1, inputs - cached.inputs)
            cached.state.follow(events, ((decode_input(text), digest) for text, digest in sent))
            cached.batches, cached.inputs = batches, inputs
        return inputs == record.inputs

    def copy(self, mission: str) -> CachedState:
        """Return a copy of what is cached of a mission."""
        return replace(cached := self._cache[mission], state=deepcopy(cached.state))

    def add(self, mission: str, prepared: CachedState) -> None:
        """Cache a state that was prepared elsewhere, unless there is one."""
        if mission not in self._cache:
            # a copy: whoever prepared it may need it again
            self._cache[mission] = replace(prepared, state=deepcopy(prepared.state))

    def replace(self, record: MissionRecord, state: MissionState) -> None:
        """Replace a cached state by `state`, which includes all inputs of `record`."""
        cached = self._cache[record.id]
        cached.state, cached.inputs = state, record.inputs

    def drop(self, mission: str) -> None:
        self._cache.pop(mission, None)


def brief(reader: StoreReader, record: MissionRecord) -> MissionBrief:
    row = reader.execute("SELECT brief FROM mission_briefs WHERE mission = ?", (record.number,)).fetchone()
    return decode_brief(packing.unpack(row["brief"]))
