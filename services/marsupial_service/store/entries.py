"""What jobs and missions have in common in the store: one for each idempotency key, kept until they are old."""

from __future__ import annotations

from marsupial_service.store.errors import KeyReused
from marsupial_service.store.writer import Transaction


def made_before(tx: Transaction, table: str, owner: str, key: str | None, digest: bytes) -> str | None:
    """Return the id of what an earlier request with that key has made, if there is any.

    Raises
    ------
    KeyReused
        If that request was another one.
    """
    if key is None:
        return None
    row = tx.execute(f"SELECT id, digest FROM {table} WHERE owner = ? AND idempotency_key = ?", (owner, key)).fetchone()
    if row is None:
        return None
    if row["digest"] != digest:
        raise KeyReused(f"the idempotency key {key!r} was used for another request")
    found: str = row["id"]
    return found


def remove_old(tx: Transaction, table: str, before_ms: int, kept: int, most: int) -> int:
    """Remove at most `most` of those that ended before a moment or are not among the `kept` that ended last.

    Their followers are told. Returns how many were removed.
    """
    rows = tx.execute(
        f"SELECT number, id FROM {table} WHERE finished_ms < ?"
        f" OR number IN (SELECT number FROM {table} WHERE finished_ms IS NOT NULL"
        " ORDER BY finished_ms DESC, number DESC LIMIT -1 OFFSET ?) LIMIT ?",
        (before_ms, kept, most),
    ).fetchall()
    for number, name in rows:
        tx.execute(f"DELETE FROM {table} WHERE number = ?", (number,))
        tx.news.add(name)
    return len(rows)
