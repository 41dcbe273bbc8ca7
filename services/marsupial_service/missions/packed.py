"""The inputs and events of a mission as packed rows: one input per row, or all events of a batch.

The events of a batch are lines of text: type, then data. The events that a mission waits for the quota of its owner, or
waits no more, have rows of their own: they come from a server, not from the process of the mission.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from marsupial_service.missions.encoding import encode_input
from marsupial_service.missions.values import Input, StoredEvent
from marsupial_service.schemas.enums import EventType
from marsupial_service.store import Transaction, packing
from marsupial_service.store.tables import ROW_BYTES
from marsupial_service.store.transaction import StoreReader

_INPUTS = "SELECT seq, part, digest, data FROM mission_inputs WHERE mission = ?"
_EVENTS = "SELECT seq, part, batch, data FROM mission_events WHERE mission = ?"
_IN_ORDER = "ORDER BY seq, part"
# a range in the order of the index: asked for one batch in the order of the rows, SQLite scans the whole mission
_OF_BATCHES = f"{_EVENTS} AND batch BETWEEN ? AND ? ORDER BY batch, seq, part"
_QUOTA, _DECISION = f"{EventType.QUOTA} ".encode(), f"{EventType.DECISION} ".encode()


def add_input(tx: Transaction, number: int, seq: int, data: Input, digest: bytes | None, now_ms: int) -> None:
    """Store an input of mission `number`, with the digest of its request; those of operators may have none."""
    stored = packing.pack(encode_input(data))
    more = len(stored) + ROW_BYTES + len(digest or b"")
    tx.execute("UPDATE missions SET inputs = ?, bytes = bytes + ? WHERE number = ?", (seq, more, number))
    head: dict[str, Any] = {"mission": number, "seq": seq, "at_ms": now_ms}
    for part, piece in packing.split(stored):
        tx.insert("mission_inputs", **head, part=part, digest=None if part else digest, data=piece)


def inputs_from(reader: StoreReader, number: int, seq: int, most: int) -> Iterator[tuple[bytes, bytes | None]]:
    """Yield the stored texts of at most `most` inputs of a mission, from number `seq` on, with their digests."""
    rows = reader.execute(f"{_INPUTS} AND seq >= ? AND seq < ? {_IN_ORDER}", (number, seq, seq + most))
    return ((data, row["digest"]) for row, data in packing.joined(rows))


def add_events(tx: Transaction, number: int, batches: Mapping[int, Sequence[StoredEvent]], now_ms: int) -> None:
    """Store the next events of a mission, by batch number; followers are notified after the commit."""
    stored = {batch: packing.pack(text_of(events)) for batch, events in batches.items()}
    sql = "UPDATE missions SET events = events + ?, bytes = bytes + ? WHERE number = ? RETURNING id, events"
    count, more = sum(map(len, batches.values())), sum(len(data) + ROW_BYTES for data in stored.values())
    row = tx.execute(sql, (count, more, number)).fetchone()
    last = row["events"] - count
    for batch, data in stored.items():
        last += len(batches[batch])
        for part, piece in packing.split(data):
            head = {"mission": number, "seq": last, "part": part, "batch": batch}
            tx.insert("mission_events", **head, data=piece, at_ms=now_ms)
    tx.news.add(row["id"])


def text_of(events: Sequence[StoredEvent]) -> bytes:
    """Return the text of the events of a batch."""
    return "\n".join(f"{one.type} {one.data}" for one in events).encode()


def events_of(reader: StoreReader, number: int, first: int, last: int) -> Iterator[StoredEvent]:
    """Yield the events of a mission's batches from number `first` to `last`."""
    rows = reader.execute(_OF_BATCHES, (number, first, last))
    return (event for _, event in _events(rows, 0))


def batches_of(reader: StoreReader, number: int, first: int, last: int) -> Iterator[bytes]:
    """Yield the texts of a mission's batches from number `first` to `last`, without events of quotas."""
    rows = reader.execute(_OF_BATCHES, (number, first, last))
    return (text for _, text in packing.joined(rows) if not text.startswith(_QUOTA))


def decisions_in(text: bytes) -> tuple[str, ...]:
    """Return the data of the decisions among the events of a batch."""
    return tuple(line[len(_DECISION) :].decode() for line in text.split(b"\n") if line.startswith(_DECISION))


def events_after(
    reader: StoreReader, number: int, seq: int = 0, batches: int | None = None
) -> Iterator[tuple[int, StoredEvent]]:
    """Yield the events after number `seq` with their numbers, from about `batches` batches (None: all)."""
    if batches is None:
        rows = reader.execute(f"{_EVENTS} AND seq > ? {_IN_ORDER}", (number, seq))
    else:
        ends = "SELECT seq FROM mission_events WHERE mission = ? AND seq > ? AND part = 0 ORDER BY seq LIMIT ?"
        last = f"SELECT max(seq) FROM ({ends}) AS ends"
        sql = f"{_EVENTS} AND seq > ? AND seq <= ({last}) {_IN_ORDER}"
        rows = reader.execute(sql, (number, seq, number, seq, batches))
    yield from _events(rows, seq)


def remove(tx: Transaction, number: int, most: int) -> int:
    """Remove about `most` rows of a mission or fewer, oldest first; return how many."""
    removed = 0
    for table in ("mission_inputs", "mission_events"):
        oldest = f"SELECT seq FROM {table} WHERE mission = ? ORDER BY seq LIMIT ?"
        sql = f"DELETE FROM {table} WHERE mission = ? AND seq <= (SELECT max(seq) FROM ({oldest}) AS oldest)"
        removed += tx.execute(sql, (number, number, max(0, most - removed))).rowcount
    return removed


def _events(rows: Any, after: int) -> Iterator[tuple[int, StoredEvent]]:
    for row, data in packing.joined(rows):
        lines = data.decode().split("\n")
        first = row["seq"] - len(lines) + 1
        for seq, line in enumerate(lines, start=first):
            if seq > after:
                kind, _, text = line.partition(" ")
                yield seq, StoredEvent(EventType(kind), text)
