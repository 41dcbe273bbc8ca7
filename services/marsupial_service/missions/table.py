"""What happens to missions in the store, each change in one transaction, and what can be read of them."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from marsupial.errors import Problem
from marsupial.model.mission import Status
from marsupial_service.entries.records import Created, NewEntry, TooMany
from marsupial_service.entries.table import EntryTable, Reader, made_of
from marsupial_service.missions import documents
from marsupial_service.missions.ledger import Conflict, Ledger
from marsupial_service.missions.records import MOVES, WISHED, MissionPhase, MissionRecord, MissionSettings
from marsupial_service.missions.values import Brief, Event, EventType, Input, Report, Turn, Wish
from marsupial_service.store import Transaction, kept


def _record(row: sqlite3.Row) -> MissionRecord:
    return made_of(MissionRecord, row, state=MissionPhase(row["state"]))


MISSIONS = EntryTable(
    name="missions",
    events_name="mission_events",
    noun="mission",
    select="SELECT * FROM missions",
    record=_record,
    event_type=EventType,
    moves=MOVES,
)
"""The table of missions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NewMission(NewEntry):
    """A mission to be stored; `packed` is the pickled brief."""

    brief: Brief
    packed: bytes


def insert(tx: Transaction, new: NewMission, settings: MissionSettings, now_ms: int) -> Created[MissionRecord]:
    """Store a mission, or find the one that the same request made before. Raises KeyReused, TooMany."""

    def add() -> None:
        (count,) = tx.execute("SELECT count(*) FROM missions WHERE finished_ms IS NULL").fetchone()
        if count >= settings.missions:
            raise TooMany(f"there are {count} open missions, more are not allowed at a time")
        brief = new.brief
        described = {"name": brief.name, "strategy": brief.strategy, "planner": brief.planner}
        number = MISSIONS.add(tx, new, MissionPhase.RUNNING, now_ms, **described)
        tx.insert("mission_briefs", mission=number, brief=new.packed)

    return MISSIONS.create(tx, new, add)


def add_reports(tx: Transaction, mission: str, reports: Sequence[tuple[Report, bytes]], now_ms: int) -> MissionRecord:
    """Store reports and their digests, all or none. Raises Conflict if the mission has ended."""
    record = MISSIONS.existing(tx, mission)
    if record.state is MissionPhase.ENDED:
        raise Conflict(over(record))
    for report, digest in reports:
        _add_input(tx, record, report, digest, now_ms)
        record = replace(
            record,
            inputs=record.inputs + 1,
            n=record.n if report.robot is not None else report.n,
            t_ms=max(record.t_ms, report.t_ms),
        )
    MISSIONS.change(tx, record.number, n=record.n, t_ms=record.t_ms)
    return MISSIONS.existing(tx, mission)


def add_wish(tx: Transaction, mission: str, wish: Wish, now_ms: int) -> MissionRecord:
    """Store a wish that changes something. Raises Conflict if it comes too late, UnknownEntry."""
    record = MISSIONS.existing(tx, mission)
    if MISSIONS.move(tx, record.number, WISHED[wish], now_ms):
        _add_input(tx, record, wish, None, now_ms)
    elif wish is not Wish.CANCEL and record.state is not WISHED[wish]:
        raise Conflict(over(record))
    return MISSIONS.existing(tx, mission)


def add_turn(tx: Transaction, mission: str, number: int, turn: Turn, now_ms: int) -> bool:
    """Store what a mission made of its first `number` inputs; say whether it was the turn that was due."""
    record = MISSIONS.find(tx, mission)
    if record is None or record.state is MissionPhase.ENDED or record.turns != number:
        return False
    revision = max((documents.revision_of(event) for event in turn.events), default=0)
    MISSIONS.change(tx, record.number, turns=number + 1, revision=max(record.revision, revision))
    for event in turn.events:
        MISSIONS.tell(tx, record.number, event.type, event.data, now_ms, turn=number)
    if turn.over:
        end = json.loads(turn.events[-1].data)
        MISSIONS.move(tx, record.number, MissionPhase.ENDED, now_ms, status=end["status"], reason=end["reason"])
    return True


def fail(tx: Transaction, mission: str, reason: str, now_ms: int) -> None:
    """End a mission that can't go on, unless it has ended."""
    record = MISSIONS.find(tx, mission)
    if record is not None and MISSIONS.move(
        tx, record.number, MissionPhase.ENDED, now_ms, status=Status.FAILED, reason=reason
    ):
        data = documents.end(Status.FAILED, reason, record.t_ms)
        MISSIONS.tell(tx, record.number, EventType.END, data, now_ms, turn=record.turns)


def open_missions(reader: Reader) -> tuple[str, ...]:
    """Return the ids of the missions that have not ended."""
    return tuple(row["id"] for row in reader.execute("SELECT id FROM missions WHERE finished_ms IS NULL"))


def brief(reader: Reader, record: MissionRecord) -> Brief:
    """Return what a mission was created with."""
    row = reader.execute("SELECT brief FROM mission_briefs WHERE mission = ?", (record.number,)).fetchone()
    found: Brief = kept.loads(row["brief"])
    return found


def ledger(reader: Reader, record: MissionRecord) -> Ledger:
    """Return the ledger of a mission, made from all that is stored of it."""
    made = Ledger(brief(reader, record))
    for event in _events(reader, record.number, "AND type = 'commands' ORDER BY seq"):
        made.publish(event)
    sql = "SELECT digest, data FROM mission_inputs WHERE mission = ? AND digest IS NOT NULL ORDER BY seq"
    for digest, data in reader.execute(sql, (record.number,)):
        made.take(kept.loads(data), digest)
    return made


def input_at(reader: Reader, number: int, seq: int) -> Input | None:
    """Return an input of the mission with that number, or None if it has not come."""
    sql = "SELECT data FROM mission_inputs WHERE mission = ? AND seq = ?"
    row = reader.execute(sql, (number, seq)).fetchone()
    if row is None:
        return None
    found: Input = kept.loads(row["data"])
    return found


def turn_at(reader: Reader, number: int, turn: int) -> tuple[Event, ...]:
    """Return the events of a turn of the mission with that number."""
    return tuple(_events(reader, number, "AND turn = ? ORDER BY seq", turn))


def log(reader: Reader, record: MissionRecord) -> tuple[str, ...]:
    """Return the lines of the mission's log; where an earlier version began it anew, since then."""
    lines = [event.data for event in _events(reader, record.number, "AND type = 'log' ORDER BY seq")]
    starts = [i for i, text in enumerate(lines) if text.startswith('{"event":"mission"')]
    return tuple(lines[starts[-1] :]) if starts else ()


def _events(reader: Reader, number: int, rest: str, *values: object) -> Iterator[Event]:
    sql = f"SELECT type, data FROM mission_events WHERE mission = ? {rest}"
    for kind, data in reader.execute(sql, (number, *values)):
        yield Event(EventType(kind), data)


def _add_input(tx: Transaction, record: MissionRecord, data: Input, digest: bytes | None, now_ms: int) -> None:
    packed, seq = kept.dumps(data), record.inputs + 1
    tx.insert("mission_inputs", mission=record.number, seq=seq, digest=digest, data=packed, at_ms=now_ms)
    MISSIONS.change(tx, record.number, inputs=seq)


def over(record: MissionRecord) -> Problem:
    """Return why nothing more is taken."""
    end = "is being cancelled" if record.status is None else f"has ended ({record.status}: {record.reason})"
    return Problem("", f"the mission {end}")
