"""Texts stored by name, besides jobs and missions."""

from marsupial_service.store.transaction import StoreReader, Transaction


def text_of(reader: StoreReader, name: str) -> str | None:
    """Return the text of that name, if there is one."""
    row = reader.execute("SELECT text FROM documents WHERE name = ?", (name,)).fetchone()
    return None if row is None else str(row["text"])


def texts_of(reader: StoreReader, prefix: str) -> dict[str, str]:
    """Return all texts whose names begin with `prefix`, by the rest of their names."""
    sql = "SELECT name, text FROM documents WHERE substr(name, 1, ?) = ?"
    return {row["name"][len(prefix) :]: row["text"] for row in reader.execute(sql, (len(prefix), prefix))}


def store_text(tx: Transaction, name: str, text: str) -> None:
    """Store a text under a name, replacing the old one; to derive it from the old one, first lock the name."""
    sql = "INSERT INTO documents VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET text = excluded.text"
    tx.execute(sql, (name, text))
