"""What happens to missions in the store, each change in one transaction, and what can be read of them."""

from __future__ import annotations

import pickle
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, fields

from marsupial.errors import Problem
from marsupial.model.mission import Status
from marsupial_service.jobs.lookup import Source
from marsupial_service.missions import documents
from marsupial_service.missions.ledger import Conflict, Ledger
from marsupial_service.missions.records import (
    MissionEventRecord,
    MissionRecord,
    MissionSettings,
    MissionState,
    TooMany,
    UnknownMission,
)
from marsupial_service.missions.values import Brief, Event, EventType, Input, Report, Turn, Wish
from marsupial_service.store import Transaction, entries

_REMOVED_AT_ONCE = 20
_COLUMNS = ", ".join(field.name.replace("_at_ms", "_ms") for field in fields(MissionRecord))

_WISHES = {
    (MissionState.RUNNING, Wish.PAUSE): MissionState.PAUSED,
    (MissionState.PAUSED, Wish.RESUME): MissionState.RUNNING,
    (MissionState.RUNNING, Wish.CANCEL): MissionState.CANCELLING,
    (MissionState.PAUSED, Wish.CANCEL): MissionState.CANCELLING,
}
"""What a wish changes; any other is met already, or comes too late."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NewMission:
    """A mission to be stored; `packed` is the pickled brief."""

    id: str
    owner: str
    key: str | None
    digest: bytes
    brief: Brief
    packed: bytes


def insert(tx: Transaction, new: NewMission, settings: MissionSettings, now_ms: int) -> tuple[MissionRecord, bool]:
    """Store a mission, or find the one that the same request made before (True). Raises KeyReused, TooMany."""
    known = entries.made_before(tx, "missions", new.owner, new.key, new.digest)
    if known is not None:
        return existing(tx, known), True
    (count,) = tx.execute("SELECT count(*) FROM missions WHERE finished_ms IS NULL").fetchone()
    if count >= settings.missions:
        raise TooMany(f"there are {count} open missions, more are not allowed at a time")
    number = tx.execute(
        "INSERT INTO missions (id, owner, idempotency_key, digest, name, strategy, planner, state, created_ms)"
        " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (
            *(new.id, new.owner, new.key, new.digest, new.brief.name, new.brief.strategy, new.brief.planner),
            *(MissionState.RUNNING, now_ms),
        ),
    ).lastrowid
    tx.execute("INSERT INTO mission_briefs (mission, brief) VALUES (?, ?)", (number, new.packed))
    return existing(tx, new.id), False


def add_report(tx: Transaction, mission: str, report: Report, digest: bytes, now_ms: int) -> MissionRecord:
    """Store a report. Raises Conflict if the mission has ended."""
    record = existing(tx, mission)
    if record.state is MissionState.ENDED:
        raise Conflict(over(record))
    _add_input(tx, record, report, digest, now_ms)
    tx.execute("UPDATE missions SET n = ?, t_ms = ? WHERE number = ?", (report.n, report.t_ms, record.number))
    return existing(tx, mission)


def add_wish(tx: Transaction, mission: str, wish: Wish, now_ms: int) -> MissionRecord:
    """Store a wish that changes something. Raises Conflict if it comes too late, UnknownMission."""
    record = existing(tx, mission)
    state = _WISHES.get((record.state, wish))
    if state is None:
        if wish is not Wish.CANCEL and record.state in (MissionState.CANCELLING, MissionState.ENDED):
            raise Conflict(over(record))
        return record
    _add_input(tx, record, wish, None, now_ms)
    tx.execute("UPDATE missions SET state = ? WHERE number = ?", (state, record.number))
    return existing(tx, mission)


def add_turn(tx: Transaction, mission: str, number: int, turn: Turn, now_ms: int) -> bool:
    """Store what a mission made of its first `number` inputs; say whether it was the turn that was due."""
    record = find(tx, mission)
    if record is None or record.state is MissionState.ENDED or record.turns != number:
        return False
    revision = max((documents.revision_of(event) for event in turn.events), default=0)
    tx.execute(
        "UPDATE missions SET turns = turns + 1, revision = max(revision, ?) WHERE number = ?",
        (revision, record.number),
    )
    for event in turn.events:
        _tell(tx, record, event, number, now_ms)
    if turn.over:
        end = documents.end_of(turn.events[-1].data)
        _end(tx, record, end["status"], end["reason"], now_ms)
    return True


def fail(tx: Transaction, mission: str, reason: str, now_ms: int) -> None:
    """End a mission that can't go on, unless it has ended."""
    record = find(tx, mission)
    if record is not None and record.state is not MissionState.ENDED:
        data = documents.end(Status.FAILED, reason, record.t_ms)
        _tell(tx, record, Event(EventType.END, data), record.turns, now_ms)
        _end(tx, record, Status.FAILED, reason, now_ms)


def remove_old(tx: Transaction, settings: MissionSettings, now_ms: int) -> int:
    """Remove some missions that ended and are too old or too many, if there are any, and return how many."""
    before_ms = now_ms - round(1000 * settings.retention_s)
    return entries.remove_old(tx, "missions", before_ms, settings.kept_missions, _REMOVED_AT_ONCE)


def find(source: Source, mission: str, owner: str | None = None) -> MissionRecord | None:
    """Return a mission, if there is one (of that owner)."""
    sql = f"SELECT {_COLUMNS} FROM missions WHERE id = ? AND owner = coalesce(?, owner)"
    row = source.execute(sql, (mission, owner)).fetchone()
    return None if row is None else _record(row)


def existing(source: Source, mission: str) -> MissionRecord:
    """Return a mission. Raises UnknownMission."""
    record = find(source, mission)
    if record is None:
        raise UnknownMission(mission)
    return record


def missions(source: Source, owner: str, limit: int, before: str | None) -> tuple[MissionRecord, ...]:
    """Return the newest missions of an owner, those made before mission `before` only."""
    older = "" if before is None else " AND number < (SELECT number FROM missions WHERE id = ?)"
    sql = f"SELECT {_COLUMNS} FROM missions WHERE owner = ?{older} ORDER BY number DESC LIMIT ?"
    values = (owner, limit) if before is None else (owner, before, limit)
    return tuple(_record(row) for row in source.execute(sql, values))


def open_missions(source: Source) -> tuple[str, ...]:
    """Return the ids of the missions that have not ended."""
    return tuple(row["id"] for row in source.execute("SELECT id FROM missions WHERE finished_ms IS NULL"))


def brief(source: Source, record: MissionRecord) -> Brief:
    """Return what a mission was created with."""
    row = source.execute("SELECT brief FROM mission_briefs WHERE mission = ?", (record.number,)).fetchone()
    found: Brief = pickle.loads(row["brief"])
    return found


def ledger(source: Source, record: MissionRecord) -> Ledger:
    """Return the ledger of a mission, made from all that is stored of it."""
    made = Ledger(brief(source, record))
    for event in _events(source, record.number, "AND type = 'commands' ORDER BY seq"):
        made.publish(event)
    sql = "SELECT digest, data FROM mission_inputs WHERE mission = ? AND digest IS NOT NULL ORDER BY seq"
    for digest, data in source.execute(sql, (record.number,)):
        made.take(pickle.loads(data), digest)
    return made


def input_at(source: Source, number: int, seq: int) -> Input | None:
    """Return an input of the mission with that number, or None if it has not come."""
    sql = "SELECT data FROM mission_inputs WHERE mission = ? AND seq = ?"
    row = source.execute(sql, (number, seq)).fetchone()
    if row is None:
        return None
    found: Input = pickle.loads(row["data"])
    return found


def turn_at(source: Source, number: int, turn: int) -> tuple[Event, ...]:
    """Return the events of a turn of the mission with that number."""
    return tuple(_events(source, number, "AND turn = ? ORDER BY seq", turn))


def log(source: Source, record: MissionRecord) -> tuple[str, ...]:
    """Return the lines of the mission's log; where it began anew, of the last one."""
    lines = [event.data for event in _events(source, record.number, "AND type = 'log' ORDER BY seq")]
    starts = [i for i, text in enumerate(lines) if text.startswith('{"event":"mission"')]
    return tuple(lines[starts[-1] :]) if starts else ()


def events(source: Source, mission: str, after: int, limit: int) -> tuple[tuple[MissionEventRecord, ...], bool]:
    """Return the next events after number `after`, and whether more may come."""
    row = source.execute("SELECT number, finished_ms, events FROM missions WHERE id = ?", (mission,)).fetchone()
    if row is None:
        return (), False
    found = source.execute(
        "SELECT seq, type, data FROM mission_events WHERE mission = ? AND seq > ? ORDER BY seq LIMIT ?",
        (row["number"], after, limit),
    ).fetchall()
    told = tuple(MissionEventRecord(seq=seq, type=EventType(kind), data=data) for seq, kind, data in found)
    last = told[-1].seq if told else after
    return told, row["finished_ms"] is None or last < row["events"]


def counts(source: Source) -> dict[str, int]:
    """Return how many missions there are by state."""
    rows = source.execute("SELECT state, count(*) FROM missions GROUP BY 1")
    return {state.value: 0 for state in MissionState} | dict(rows.fetchall())


def _events(source: Source, number: int, rest: str, *values: object) -> Iterator[Event]:
    sql = f"SELECT type, data FROM mission_events WHERE mission = ? {rest}"
    for kind, data in source.execute(sql, (number, *values)):
        yield Event(EventType(kind), data)


def _record(row: sqlite3.Row) -> MissionRecord:
    values = {field.name: row[field.name.replace("_at_ms", "_ms")] for field in fields(MissionRecord)}
    return MissionRecord(**values | {"state": MissionState(row["state"])})


def _add_input(tx: Transaction, record: MissionRecord, data: Input, digest: bytes | None, now_ms: int) -> None:
    tx.execute(
        "INSERT INTO mission_inputs (mission, seq, digest, data, at_ms) VALUES (?, ?, ?, ?, ?)",
        (record.number, record.inputs + 1, digest, pickle.dumps(data, pickle.HIGHEST_PROTOCOL), now_ms),
    )
    tx.execute("UPDATE missions SET inputs = inputs + 1 WHERE number = ?", (record.number,))


def _tell(tx: Transaction, record: MissionRecord, event: Event, turn: int, now_ms: int) -> None:
    (seq,) = tx.execute(
        "UPDATE missions SET events = events + 1 WHERE number = ? RETURNING events", (record.number,)
    ).fetchone()
    tx.execute(
        "INSERT INTO mission_events (mission, seq, turn, type, data, at_ms) VALUES (?, ?, ?, ?, ?, ?)",
        (record.number, seq, turn, event.type, event.data, now_ms),
    )
    tx.news.add(record.id)


def _end(tx: Transaction, record: MissionRecord, status: str, reason: str, now_ms: int) -> None:
    tx.execute(
        "UPDATE missions SET state = ?, status = ?, reason = ?, finished_ms = ? WHERE number = ?",
        (MissionState.ENDED, status, reason, now_ms, record.number),
    )


def over(record: MissionRecord) -> Problem:
    """Return why nothing more is taken."""
    end = "is being cancelled" if record.status is None else f"has ended ({record.status}: {record.reason})"
    return Problem("", f"the mission {end}")
