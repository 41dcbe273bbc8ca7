"""Changes to missions in the store, each in one transaction, and reads of them."""

import json
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from copy import deepcopy
from dataclasses import astuple, dataclass
from enum import StrEnum
from itertools import islice
from typing import Any

from marsupial.errors import Problem
from marsupial.model.mission import Status
from marsupial.model.missionframe import MissionFrame
from marsupial.model.robots import Role
from marsupial.model.zones import MOST_ZONES, DatedZone, ZoneChange
from marsupial_service.entries.capacity import StoreCapacity
from marsupial_service.entries.documents import line, text_of
from marsupial_service.entries.quota import Quota
from marsupial_service.entries.records import Created, NewEntry, TooMany
from marsupial_service.entries.table import EntryTable, record_of
from marsupial_service.missions import packed
from marsupial_service.missions.records import STATE_AFTER, TRANSITIONS, MissionRecord
from marsupial_service.missions.room import open_missions
from marsupial_service.missions.state import MissionStates, ReportConflict, new_reports
from marsupial_service.missions.values import (
    Control,
    MissionBatch,
    MissionBrief,
    RobotSimulation,
    StoredEvent,
    StoredReport,
)
from marsupial_service.schemas.answers import SimulationAnswer
from marsupial_service.schemas.enums import EventType, MissionPhase
from marsupial_service.schemas.events import MissionEndData, QuotaData
from marsupial_service.settings import ServiceLimits
from marsupial_service.store import Transaction
from marsupial_service.store.engine import StoreRow
from marsupial_service.store.tables import ENTRY_BYTES, ROW_BYTES
from marsupial_service.store.transaction import StoreReader
from marsupial_service.timestamps import timestamp

_LEAST_PLANNING_S = 0.1
# the end of a mission that is cancelled while no server can continue it
LEFT = "cancelled while no server could continue it"
# states in which operators can change nothing any more
_OVER = (MissionPhase.CANCELLING, MissionPhase.ENDED)


def _record(row: StoreRow) -> MissionRecord:
    frame = None if row["frame"] is None else MissionFrame(*json.loads(row["frame"]))
    simulation = row["simulation"] and SimulationAnswer.model_validate_json(row["simulation"])
    own = {"state": MissionPhase(row["state"]), "frame": frame, "simulation": simulation}
    return record_of(MissionRecord, row, **own)


class MissionTable(EntryTable[MissionRecord]):
    """The table of missions, whose events are stored by batches."""

    def add_event(self, tx: Transaction, number: int, kind: StrEnum, data: str, now_ms: int, **more: Any) -> None:
        """Add the next event of a mission, to its batch `batch`."""
        packed.add_events(tx, number, {more["batch"]: [StoredEvent(EventType(kind), data)]}, now_ms)

    def _events(self, reader: StoreReader, number: int, after: int, limit: int) -> Iterator[tuple[int, str, str]]:
        for seq, event in islice(packed.events_after(reader, number, after, limit), limit):
            yield seq, event.type, event.data

    def _remove_rows(self, tx: Transaction, number: int, most: int) -> int:
        return packed.remove(tx, number, most)


MISSIONS = MissionTable(
    name="missions",
    events_name="mission_events",
    noun="mission",
    select="SELECT * FROM missions",
    record=_record,
    event_type=EventType,
    transitions=TRANSITIONS,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class NewMission(NewEntry):
    """A mission to store; `packed` is the stored form of its brief, `version` that of the code that runs it."""

    brief: MissionBrief
    packed: bytes
    version: str


def insert(
    tx: Transaction, new: NewMission, limits: ServiceLimits, capacity: StoreCapacity, now_ms: int
) -> Created[MissionRecord]:
    """Store a mission with this server as its holder, or find the one that the same request created.

    Raises KeyReused, StoreFull, TooMany.
    """

    def add() -> None:
        capacity.check(tx, new.owner)
        brief = new.brief
        open_missions(tx, new.owner).check(limits, simulated=brief.simulation is not None)
        Quota(limits).check(tx, new.owner, required_s(brief), now_ms)
        number = MISSIONS.add(
            tx,
            new,
            MissionPhase.RUNNING,
            now_ms,
            name=brief.name,
            strategy=brief.strategy,
            planner=brief.planner,
            version=new.version,
            simulation=None if brief.simulation is None else _simulation_text(brief, brief.simulation),
            bytes=ENTRY_BYTES + ROW_BYTES + len(new.packed),
        )
        tx.insert("mission_briefs", mission=number, brief=new.packed)
        MISSIONS.take_over(tx, number)

    return MISSIONS.create(tx, new, add)


def _simulation_text(brief: MissionBrief, simulation: RobotSimulation) -> str:
    roles = {kind.name: kind.role for kind in brief.kinds}
    count = Counter(roles[robot.type] for robot in brief.robots)
    carriers, rovers = count[Role.CARRIER], count[Role.ROVER]
    return text_of(SimulationAnswer.of(simulation, seed=brief.seed, carriers=carriers, rovers=rovers))


def required_s(brief: MissionBrief) -> float:
    """Return the seconds of quota that a mission needs before it plans: its budget; for one in steps, the minimum."""
    return max(_LEAST_PLANNING_S, brief.budget.seconds or 0.0)


def add_quota_event(tx: Transaction, mission: str, term: int, reason: str, wait_s: float, now_ms: int) -> None:
    """Add the event that a mission waits until its owner may plan again, or (empty `reason`) that it continues."""
    record = locked(tx, mission, term)
    if record is not None:
        data = QuotaData(state="running", t_ms=record.t_ms)
        if reason:
            room_at = timestamp(now_ms + round(1000 * wait_s))
            data = QuotaData(state="waiting", reason=reason, room_at=room_at, t_ms=record.t_ms)
        MISSIONS.add_event(tx, record.number, EventType.QUOTA, text_of(data), now_ms, batch=record.batches)


def add_reports(
    tx: Transaction,
    states: MissionStates,
    mission: str,
    sent: Sequence[StoredReport],
    limits: ServiceLimits,
    capacity: StoreCapacity,
    now_ms: int,
) -> MissionRecord:
    """Check reports and store them with their digests, all or none; repeated reports change nothing.

    Raises ReportConflict (also if the mission has ended), StoreFull, TooMany if too many wait, UnknownEntry.
    """
    record = MISSIONS.locked(tx, mission)
    state = states.of(tx, record)
    tried = state if len(sent) == 1 else deepcopy(state)
    new = new_reports(tried, sent, limits.cells)
    if not new:
        return record
    if record.state is MissionPhase.ENDED:
        raise ReportConflict(ended_problem(record))
    _check_backlog(record, limits)
    capacity.check(tx, record.owner, of_reports=True)
    for seq, (report, digest) in enumerate(new, start=record.inputs + 1):
        packed.add_input(tx, record.number, seq, report, digest, now_ms)
    tx.news.add(inputs_of(mission))
    # registered before the state changes, as any statement may fail
    tx.on_rollback.append(lambda: states.drop(mission))
    if len(sent) == 1:
        tried.apply(*new[0])
    frame = None if tried.map.frame == tried.map.first_frame else line(astuple(tried.map.frame))
    MISSIONS.change(tx, record.number, n=tried.n, t_ms=tried.t_ms, frame=frame)
    record = MISSIONS.existing(tx, mission)
    states.replace(record, tried)
    return record


def add_control(
    tx: Transaction, states: MissionStates, mission: str, control: Control, digest: bytes | None, now_ms: int
) -> MissionRecord:
    """Store a control unless it changes nothing, or its request (by `digest`) is a copy of an earlier one.

    Raises KeyReused if another request had its key, ReportConflict if it comes too late, UnknownEntry.
    """
    record, after = MISSIONS.locked(tx, mission), STATE_AFTER[control]
    if states.of(tx, record).was_asked(digest):
        return record
    if control is Control.RESUME and states.of(tx, record).winding_down:
        after = MissionPhase.WINDING_DOWN
    if MISSIONS.transition(tx, record.number, after, now_ms):
        _add_wish(tx, record, control, digest, now_ms)
    elif control is not Control.CANCEL and record.state is not after:
        raise ReportConflict(ended_problem(record))
    elif digest is not None and record.state not in _OVER:
        _add_wish(tx, record, Control.NOTHING, digest, now_ms)
    return MISSIONS.existing(tx, mission)


def change_zone(
    tx: Transaction,
    states: MissionStates,
    mission: str,
    change: ZoneChange,
    digest: bytes | None,
    limits: ServiceLimits,
    capacity: StoreCapacity,
    now_ms: int,
) -> tuple[DatedZone, ...]:
    """Store a change of a zone, as `add_control` does; return the zones of the mission after it.

    Raises KeyReused, ReportConflict if it comes too late or there are too many zones, StoreFull, TooMany if too many
    inputs wait, UnknownEntry.
    """
    record = MISSIONS.locked(tx, mission)
    state = states.of(tx, record)
    changes, over = state.changes(change), record.state in _OVER
    if state.was_asked(digest) or (not changes and (digest is None or over)):
        return state.zones
    if over:
        raise ReportConflict(ended_problem(record))
    if changes and len(state.zones) >= MOST_ZONES and change.zone is not None:
        raise ReportConflict(Problem("", f"the limit of {MOST_ZONES} zones is reached"))
    _check_backlog(record, limits)
    capacity.check(tx, record.owner, of_reports=True)
    tx.on_rollback.append(lambda: states.drop(mission))
    _add_wish(tx, record, change if changes else Control.NOTHING, digest, now_ms)
    return states.of(tx, MISSIONS.existing(tx, mission)).zones


def _add_wish(
    tx: Transaction, record: MissionRecord, wish: Control | ZoneChange, digest: bytes | None, now_ms: int
) -> None:
    packed.add_input(tx, record.number, record.inputs + 1, wish, digest, now_ms)
    tx.news.add(inputs_of(record.id))


def _check_backlog(record: MissionRecord, limits: ServiceLimits) -> None:
    if record.inputs - record.batches >= limits.backlog:
        raise TooMany(f"the limit of {limits.backlog} waiting reports is reached")


def add_batches(
    tx: Transaction, mission: str, term: int, number: int, batches: Sequence[MissionBatch], now_ms: int
) -> tuple[int, ...] | None:
    """Store a mission's batches for its inputs from `number` on; return how long each input has waited, in ms.

    None if these batches were not due: the mission has ended, or another server has taken it over since `term` began.
    """
    record = locked(tx, mission, term)
    if record is None or record.batches != number:
        return None
    sql = "SELECT at_ms FROM mission_inputs WHERE mission = ? AND seq BETWEEN ? AND ? AND part = 0 ORDER BY seq"
    rows = tx.execute(sql, (record.number, number, number + len(batches) - 1)).fetchall()
    MISSIONS.change(tx, record.number, batches=number + len(batches), revision=batches[-1].revision)
    packed.add_events(tx, record.number, {i: batch.events for i, batch in enumerate(batches, number)}, now_ms)
    if batches[-1].over:
        end = json.loads(batches[-1].events[-1].data)
        MISSIONS.transition(tx, record.number, MissionPhase.ENDED, now_ms, status=end["status"], reason=end["reason"])
    return tuple(now_ms - row["at_ms"] for row in rows)


def fail(tx: Transaction, mission: str, term: int, reason: str, now_ms: int) -> None:
    """End a mission that can't continue, unless it has ended or now belongs to another server."""
    record = locked(tx, mission, term)
    if record is not None:
        _end(tx, record, Status.FAILED, reason, now_ms)


def leave(tx: Transaction, mission: str, term: int, reason: str, now_ms: int) -> None:
    """Leave an open mission to other servers, with the reason; end it if it is being cancelled."""
    record = locked(tx, mission, term)
    if record is not None and record.state is MissionPhase.CANCELLING:
        _end(tx, record, Status.CANCELLED, LEFT, now_ms)
    elif record is not None:
        MISSIONS.change(tx, record.number, holder=None, reason=reason)
        tx.news.add(MISSIONS.orphaned_topic)


def adopt(tx: Transaction, mission: str, term: int, version: str) -> bool:
    """Note that this version continues a mission; return whether it is open and still this server's."""
    if (record := locked(tx, mission, term)) is not None:
        MISSIONS.change(tx, record.number, version=version, reason="")
    return record is not None


def counts(reader: StoreReader, now_ms: int) -> dict[str, Any]:
    """Return counts and ages for operators by the names of their metrics."""
    open_ones = "FROM missions WHERE finished_ms IS NULL"
    (backlog,) = reader.execute(f"SELECT coalesce(sum(inputs + 1 - batches), 0) {open_ones}").fetchone()
    (left,) = reader.execute(f"SELECT count(*) {open_ones} AND reason != ''").fetchone()
    owners = dict(map(tuple, reader.execute(f"SELECT owner, count(*) {open_ones} GROUP BY owner").fetchall()))
    return {
        "missions": MISSIONS.counts(reader, "state", MissionPhase),
        "backlog": int(backlog),
        "missions_left": int(left),
        "missions_open": owners,
        **{name: _oldest_s(reader, table, now_ms) for name, table in _AGES.items()},
    }


# the table whose newest row of a mission is its last report or control, or its last commands
_AGES = {"report_age_seconds": "mission_inputs", "commands_age_seconds": "mission_events"}


def _oldest_s(reader: StoreReader, table: str, now_ms: int) -> float:
    """Return for how long the open mission that waits for longest has had no new row in a table, 0 without missions."""
    last = f"SELECT at_ms FROM {table} WHERE mission = number ORDER BY seq DESC LIMIT 1"
    sql = f"SELECT coalesce(({last}), created_ms) AS last_ms FROM missions WHERE finished_ms IS NULL"
    return max((max(0, now_ms - row["last_ms"]) / 1000 for row in reader.execute(sql)), default=0.0)


def abandoned(reader: StoreReader, idle_s: float, now_ms: int) -> tuple[tuple[str, str, bool], ...]:
    """Return the id and owner of every open mission, and whether it has had no input for `idle_s`."""
    last = "SELECT at_ms FROM mission_inputs WHERE mission = number ORDER BY seq DESC LIMIT 1"
    rows = reader.execute(
        f"SELECT id, owner, coalesce(({last}), created_ms) AS last_ms FROM missions WHERE finished_ms IS NULL"
    )
    return tuple((row["id"], row["owner"], row["last_ms"] < now_ms - 1000 * idle_s) for row in rows)


def cancel_abandoned(tx: Transaction, mission: str, reason: str, now_ms: int) -> None:
    """Cancel a mission without a stop report, unless it has ended: no client is there to carry out its commands."""
    record = MISSIONS.locked(tx, mission)
    if _end(tx, record, Status.CANCELLED, reason, now_ms):
        tx.news.add(inputs_of(mission))


def _end(tx: Transaction, record: MissionRecord, status: Status, reason: str, now_ms: int) -> bool:
    if not MISSIONS.transition(tx, record.number, MissionPhase.ENDED, now_ms, status=status, reason=reason):
        return False
    data = text_of(MissionEndData(status=status, reason=reason, t_ms=record.t_ms))
    MISSIONS.add_event(tx, record.number, EventType.END, data, now_ms, batch=record.batches)
    return True


def current_in_term(reader: StoreReader, mission: str, term: int) -> MissionRecord | None:
    """Return an open mission if `term` is its current term."""
    record = MISSIONS.find(reader, mission)
    return None if record is None or record.term != term or record.state is MissionPhase.ENDED else record


def locked(tx: Transaction, mission: str, term: int) -> MissionRecord | None:
    """Return the same, with the mission locked against other servers until the end of the transaction."""
    MISSIONS.lock(tx, mission)
    return current_in_term(tx, mission, term)


def take_over_orphans(
    tx: Transaction, most: int, ours: Collection[str], left: Collection[str]
) -> tuple[MissionRecord, ...]:
    """Take over at most `most` open missions that no live server holds, none of those that this one has `left`.

    This includes missions held by this server but not among `ours`: the connection to the database broke right after
    the commit, so this server never learned that it holds them.
    """
    unknown, not_left = ("".join(", ?" for _ in some) for some in (ours, left))
    rows = tx.execute(
        f"SELECT number, id FROM missions WHERE finished_ms IS NULL AND (holder IS NULL OR holder NOT IN ({tx.live})"
        f" OR (holder = ? AND id NOT IN (''{unknown}))) AND id NOT IN (''{not_left})"
        f" ORDER BY number LIMIT ?{tx.skip_locked}",
        (tx.server, *ours, *left, most),
    ).fetchall()
    for number, _ in rows:
        MISSIONS.take_over(tx, number)
    return tuple(MISSIONS.existing(tx, mission) for _, mission in rows)


def release_all(tx: Transaction) -> None:
    """Leave all open missions of this server to others."""
    tx.execute("UPDATE missions SET holder = NULL WHERE holder = ? AND finished_ms IS NULL", (tx.server,))
    tx.news.add(MISSIONS.orphaned_topic)


def inputs_of(mission: str) -> str:
    """Return the topic that notifies the supervisor of a mission of new inputs."""
    return f"{mission}/inputs"


def log(reader: StoreReader, record: MissionRecord) -> str:
    """Return the mission's log."""
    events = packed.events_after(reader, record.number)
    return "".join(f"{event.data}\n" for _, event in events if event.type is EventType.LOG)


def ended_problem(record: MissionRecord) -> Problem:
    """Return the problem that a mission accepts no more input."""
    end = "is being cancelled" if record.status is None else f"has ended ({record.status}: {record.reason})"
    return Problem("", f"the mission {end}")
