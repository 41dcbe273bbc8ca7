"""The table of one kind of entry in the store: jobs or missions.

Each change is part of a transaction. A change to a state that can't follow the entry's current state comes too late: it
changes nothing and reports that. So each entry reaches a final state exactly once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Generic, TypeVar

from marsupial_service.entries.records import Created, E, EventBatch, EventRecord, NewEntry, UnknownEntry, is_replayed
from marsupial_service.store import Transaction
from marsupial_service.store.engine import StoreRow
from marsupial_service.store.tables import ROW_BYTES
from marsupial_service.store.transaction import StoreReader

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

# entries removed in one transaction: this takes 50 ms, and other writes should not wait longer
_MOST_ENTRIES = 50
_MOST_ROWS = 10_000
_ANY_NUMBER = 1 << 62  # OFFSET needs a LIMIT

W = TypeVar("W", bound=StrEnum)
R = TypeVar("R", bound="DataclassInstance")


def record_of(kind: type[R], row: StoreRow, **more: object) -> R:
    """Return a record from the columns named like its fields (`created_ms` for `created_at_ms`), and `more`."""
    names = [field.name for field in fields(kind) if field.name not in more]
    return kind(**{name: row[name.replace("_at_ms", "_ms")] for name in names}, **more)


@dataclass(frozen=True, slots=True, kw_only=True)
class EntryTable(Generic[E]):
    """A table of entries and the table of their events.

    `noun` names an entry, and is the column of the events table that refers to it. `select` returns the columns that
    `record` turns into records. `transitions` has the states that may follow each state: none if it is final.
    """

    name: str
    events_name: str
    noun: str
    select: str
    record: Callable[[StoreRow], E]
    event_type: type[StrEnum]
    transitions: Mapping[StrEnum, frozenset[StrEnum]]

    @property
    def orphaned_topic(self) -> str:
        """The topic of entries whose holder has left them."""
        return f"{self.name}/left"

    def create(self, tx: Transaction, new: NewEntry, add: Callable[[], None]) -> Created[E]:
        """Return the entry that an earlier request with that key created, or the one that `add` adds. Raises KeyReused.

        Only one server at a time adds to a table, so counts that `add` makes stay correct.
        """
        tx.lock(self.name)
        known = self.find_replayed(tx, new)
        if known is None:
            add()
        return Created(self.existing(tx, known or new.id), replayed=known is not None)

    def find_replayed(self, reader: StoreReader, new: NewEntry) -> str | None:
        """Return the id of the entry that an earlier request with that key created, if any. Raises KeyReused."""
        if new.key is None:
            return None
        sql = f"SELECT id, digest FROM {self.name} WHERE owner = ? AND idempotency_key = ?"
        row = reader.execute(sql, (new.owner, new.key)).fetchone()
        return str(row["id"]) if row is not None and is_replayed(row["digest"], new.digest) else None

    def add(self, tx: Transaction, new: NewEntry, state: StrEnum, now_ms: int, **more: object) -> int:
        """Add a row, with `more` columns, and return its number."""
        head = {"id": new.id, "owner": new.owner, "idempotency_key": new.key, "digest": new.digest}
        tx.insert(self.name, **head, state=state, created_ms=now_ms, **more)
        return int(tx.execute(f"SELECT number FROM {self.name} WHERE id = ?", (new.id,)).fetchone()["number"])

    def find(self, reader: StoreReader, entry: str, owner: str | None = None) -> E | None:
        """Return an entry (of that owner), None if there is none."""
        where = f"WHERE {self.name}.id = ? AND {self.name}.owner = coalesce(?, {self.name}.owner)"
        row = reader.execute(f"{self.select} {where}", (entry, owner)).fetchone()
        return None if row is None else self.record(row)

    def existing(self, reader: StoreReader, entry: str, owner: str | None = None) -> E:
        """Return an entry (of that owner). Raises UnknownEntry."""
        record = self.find(reader, entry, owner)
        if record is None:
            raise UnknownEntry(self.noun)
        return record

    def lock(self, tx: Transaction, entry: str) -> None:
        """Lock an entry, if it exists, against other servers until the end of the transaction."""
        if tx.row_lock:  # otherwise there is only one writer
            tx.execute(f"SELECT 1 FROM {self.name} WHERE id = ?{tx.row_lock}", (entry,)).fetchone()

    def locked(self, tx: Transaction, entry: str) -> E:
        """Lock an entry against other servers until the end of the transaction, and return it. Raises UnknownEntry."""
        self.lock(tx, entry)
        return self.existing(tx, entry)

    def newest(
        self, reader: StoreReader, owner: str, limit: int, before: str | None = None, state: StrEnum | None = None
    ) -> tuple[E, ...]:
        """Return an owner's newest entries, newest first: only those created before `before`, only those in `state`."""
        conditions: dict[str, object] = {f"{self.name}.owner = ?": owner}  # qualified: `select` may join tables
        if state is not None:
            conditions[f"{self.name}.state = ?"] = state
        if before is not None:
            conditions[f"{self.name}.number < (SELECT number FROM {self.name} WHERE id = ?)"] = before
        sql = f"{self.select} WHERE {' AND '.join(conditions)} ORDER BY {self.name}.number DESC LIMIT ?"
        return tuple(self.record(row) for row in reader.execute(sql, (*conditions.values(), limit)))

    def transition(self, tx: Transaction, number: int, state: StrEnum, now_ms: int, **more: object) -> bool:
        """Move an entry to another state and set `more` columns; return whether its old state allowed that."""
        if not self.transitions[state]:
            more["finished_ms"] = now_ms
        before = [former for former, states in self.transitions.items() if state in states]
        return self._set(tx, {"number": (number,), "state": before}, state=state, **more)

    def change(self, tx: Transaction, number: int, **columns: object) -> None:
        self._set(tx, {"number": (number,)}, **columns)

    def take_over(self, tx: Transaction, number: int, **columns: object) -> int:
        """Make this server the holder of an entry, set columns, and return the new term."""
        self.change(tx, number, holder=tx.server, **columns)
        row = tx.execute(f"UPDATE {self.name} SET term = term + 1 WHERE number = ? RETURNING term", (number,))
        return int(row.fetchone()["term"])

    def _set(self, tx: Transaction, where: Mapping[str, Sequence[object]], **columns: object) -> bool:
        """Set columns of the entries whose `where` columns have the given values; return whether any matched."""
        changes = ", ".join(f"{column} = ?" for column in columns)
        which = " AND ".join(f"{column} IN ({', '.join('?' * len(values))})" for column, values in where.items())
        given = (*columns.values(), *(value for values in where.values() for value in values))
        return tx.execute(f"UPDATE {self.name} SET {changes} WHERE {which}", given).rowcount > 0

    def add_event(self, tx: Transaction, number: int, kind: StrEnum, data: str, now_ms: int, **more: object) -> None:
        """Add the next event of an entry, with `more` columns; its followers are notified after the commit."""
        sql = f"UPDATE {self.name} SET events = events + 1, bytes = bytes + ? WHERE number = ? RETURNING id, events"
        row = tx.execute(sql, (ROW_BYTES + len(data), number)).fetchone()
        event = {self.noun: number, "seq": row["events"], "type": kind, "data": data, "at_ms": now_ms}
        tx.insert(self.events_name, **event, **more)
        tx.news.add(row["id"])

    def events(self, reader: StoreReader, entry: str, after: int, limit: int) -> EventBatch:
        """Return the next events after number `after`. An entry that doesn't exist has no events and will get none."""
        sql = f"SELECT number, finished_ms, events FROM {self.name} WHERE id = ?"
        row = reader.execute(sql, (entry,)).fetchone()
        if row is None:
            return EventBatch()
        found = tuple(
            EventRecord(seq=seq, type=self.event_type(kind), data=data)
            for seq, kind, data in self._events(reader, row["number"], after, limit)
        )
        last = found[-1].seq if found else after
        return EventBatch(
            events=found, is_open=row["finished_ms"] is None or last < row["events"], stored=row["events"]
        )

    def _events(self, reader: StoreReader, number: int, after: int, limit: int) -> Iterable[tuple[int, str, str]]:
        """Return number, type and data of the next events of an entry."""
        sql = f"SELECT seq, type, data FROM {self.events_name} WHERE {self.noun} = ? AND seq > ? ORDER BY seq LIMIT ?"
        return reader.execute(sql, (number, after, limit))

    def counts(self, reader: StoreReader, column: str, words: type[W]) -> dict[W, int]:
        """Return how many entries have each word in a column."""
        found = dict(map(tuple, reader.execute(f"SELECT {column}, count(*) FROM {self.name} GROUP BY 1").fetchall()))
        return {word: found.get(word, 0) for word in words}

    def remove_old(self, tx: Transaction, retention_s: float, kept: int, now_ms: int, most: int = _MOST_ENTRIES) -> int:
        """Remove at most `most` entries that ended too long ago or before the `kept` newest; return how many."""
        before_ms = now_ms - round(1000 * retention_s)
        rows = tx.execute(
            f"SELECT number, id FROM {self.name} WHERE finished_ms < ?"
            f" OR number IN (SELECT number FROM {self.name} WHERE finished_ms IS NOT NULL"
            " ORDER BY finished_ms DESC, number DESC LIMIT ? OFFSET ?) LIMIT ?",
            (before_ms, _ANY_NUMBER, kept, most),
        ).fetchall()
        left = _MOST_ROWS
        for number, entry in rows:
            tx.news.add(entry)
            left -= self._remove_rows(tx, number, left)
            if left <= 0:  # hide the entry; the next call removes the rest of it
                self.change(tx, number, id=f"removed/{number}", owner="", idempotency_key=None)
                break
            tx.execute(f"DELETE FROM {self.name} WHERE number = ?", (number,))
        return len(rows)

    def _remove_rows(self, tx: Transaction, number: int, most: int) -> int:
        """Remove about `most` rows of an entry, fewer if deleting the entry deletes the rest; return how many."""
        return 0
