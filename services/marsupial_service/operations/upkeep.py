"""Maintenance of a store by operators: inspect it, back it up, restore it, remove old entries.

A backup is one SQLite file: the jobs and missions of one moment, and the keys, in a table that only backups have. The
last line of the file is the checksum of all before it; SQLite does not read it, as its header says where it ends.
"""

import hashlib
import os
import sqlite3
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from marsupial.errors import UsageError
from marsupial_service import keys
from marsupial_service.entries.capacity import stored_bytes
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.missions.table import MISSIONS
from marsupial_service.store import StoreError
from marsupial_service.store.opening import MaintenanceConnection, is_shared, open_for_maintenance
from marsupial_service.store.sqlite import FILE, lock_folder, private_draft
from marsupial_service.store.tables import VERSION, creation_script
from marsupial_service.store.transaction import StoreReader

COUNTED = ("jobs", "plans", "events", "missions", "mission_inputs", "mission_events")
_KEYS = "backup_keys"
_OLDEST_S = 100 * 365 * 86400.0
_ANY_NUMBER = 1 << 62
# begins the last line of a backup, which holds its checksum
_CHECKSUM = b"\nmarsupial backup sha256 "
_DIGITS = 64
# the byte of a SQLite file that says whether it has a write-ahead log, and its value then
_JOURNAL_AT, _WAL = 18, 2


@dataclass(frozen=True, slots=True, kw_only=True)
class StoreInfo:
    """The contents of a store: bytes on disk (`free_bytes` of them are unused), rows by table.

    `stored_bytes` are those of jobs and missions, as ``store_bytes`` counts them; `open` counts those that have not
    ended, `versions` the open missions by the version of the code that runs them, `left` those among them that a server
    could not continue; `oldest_ms` is when the oldest entry was created, in ms since 1970.
    """

    place: str
    version: int
    disk_bytes: int
    free_bytes: int
    stored_bytes: int
    rows: dict[str, int]
    open: dict[str, int]
    versions: dict[str, int]
    left: int
    oldest_ms: int | None


def info(place: str | Path) -> StoreInfo:
    """Return the contents of a store; servers may run meanwhile. Raises StoreError."""
    with open_for_maintenance(place) as store:
        return store.read(lambda reader: _info(store, reader))


def _info(store: MaintenanceConnection, reader: StoreReader) -> StoreInfo:
    def number(sql: str) -> int | None:
        (found,) = reader.execute(sql).fetchone()
        return None if found is None else int(found)

    first = [number(f"SELECT min(created_ms) FROM {name}") for name in ("jobs", "missions")]
    open_count = "SELECT count(*) FROM {} WHERE finished_ms IS NULL"
    versions = reader.execute("SELECT version, count(*) FROM missions WHERE finished_ms IS NULL GROUP BY 1 ORDER BY 1")
    return StoreInfo(
        place=store.engine.place,
        version=VERSION,
        disk_bytes=store.engine.disk_bytes(store.connection),
        free_bytes=store.engine.free_bytes(store.connection),
        stored_bytes=stored_bytes(reader),
        rows={name: number(f"SELECT count(*) FROM {name}") or 0 for name in COUNTED},
        open={name: number(open_count.format(name)) or 0 for name in ("jobs", "missions")},
        versions=dict(map(tuple, versions.fetchall())),
        left=number(open_count.format("missions") + " AND reason != ''") or 0,
        oldest_ms=min((one for one in first if one is not None), default=None),
    )


def live_bytes(place: str | Path) -> int:
    """Return the bytes that a folder's store would take if compacted, measured on a temporary copy."""
    _refuse_shared(place, "pg_dump, or the extension pgstattuple")
    with open_for_maintenance(place) as store, TemporaryDirectory(dir=place) as folder:
        dense = Path(folder) / FILE
        store.connection.execute("VACUUM INTO ?", (str(dense),))
        return dense.stat().st_size


def retain(place: str | Path, *, days: float | None, kept: int | None, now_ms: int) -> dict[str, int]:
    """Remove entries that ended more than `days` ago, or are not among the `kept` newest ended ones of their kind.

    Returns how many jobs and missions were removed. Servers may run meanwhile: they can write between any two steps.
    """
    if days is None and kept is None:
        raise UsageError("--days, --kept or both are required")
    retention_s = _OLDEST_S if days is None else 86400 * days
    most = _ANY_NUMBER if kept is None else kept
    removed: dict[str, int] = {}
    with open_for_maintenance(place) as store:
        for table in (JOBS, MISSIONS):
            count = f"SELECT count(*) FROM {table.name}"
            (before,) = store.read(lambda reader: tuple(reader.execute(count).fetchone()))  # noqa: B023
            while store.write(lambda tx: table.remove_old(tx, retention_s, most, now_ms)):  # noqa: B023
                pass
            (after,) = store.read(lambda reader: tuple(reader.execute(count).fetchone()))  # noqa: B023
            removed[table.name] = before - after
        while store.write(lambda tx: tx.shrink()):
            pass
        store.engine.checkpoint()
    return removed


def backup(place: str | Path, target: Path) -> None:
    """Write a snapshot of a folder's store and keys to one file; a server may run meanwhile. Raises StoreError."""
    _refuse_shared(place, "pg_dump --format=custom")
    if target.exists():
        raise UsageError(f"{target} already exists")
    folder = Path(place)
    with open_for_maintenance(folder) as store, private_draft(target) as draft:
        assert isinstance(store.connection, sqlite3.Connection)
        with closing(sqlite3.connect(draft, isolation_level=None)) as copy:
            store.connection.backup(copy)
            copy.execute("PRAGMA journal_mode = DELETE").fetchall()  # one file, without one beside it
            copy.execute(f"CREATE TABLE {_KEYS} (text TEXT NOT NULL) STRICT")
            held = folder / keys.FILE
            if held.exists():
                copy.execute(f"INSERT INTO {_KEYS} VALUES (?)", (held.read_text(encoding="utf-8"),))
            _check(copy, draft)
        digest = _digest(draft, draft.stat().st_size)
        with open(draft, "ab") as file:
            file.write(_CHECKSUM + digest + b"\n")


def restore(source: Path, folder: Path) -> tuple[int, bool]:
    """Create a folder's store from a backup; return the version of its tables, and whether it had a checksum.

    Raises UsageError if the folder has a store or keys, StoreError if the file is no sound backup.
    """
    if not source.is_file():
        raise UsageError(f"{source}: no such file")
    if any((folder / name).exists() for name in (FILE, keys.FILE)):
        raise UsageError(f"{folder} already has a store or keys; restore into a new folder")
    # a file that still has a write-ahead log is not a backup of ours, and may lack the data in the log
    with open(source, "rb") as file:
        if file.read(_JOURNAL_AT + 1)[_JOURNAL_AT:] == bytes((_WAL,)):
            raise StoreError(
                f"{source} is the file of a store in use, not a backup; create one with 'marsupial serve store backup'"
            )
    has_checksum = _verify(source)
    made = not folder.exists()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    held = lock_folder(folder / "lock")
    try:
        with private_draft(folder / FILE) as draft:
            version = _restore(source, draft, folder)
        made = False
        return version, has_checksum
    except sqlite3.Error as error:
        raise StoreError(f"{source}: {error}") from error
    finally:
        os.close(held)
        if made:  # for nothing
            with suppress(OSError):
                (folder / "lock").unlink()
                folder.rmdir()


def _verify(source: Path) -> bool:
    """Return whether a backup has a checksum. Raises StoreError if it is another file's."""
    size = source.stat().st_size - len(_CHECKSUM) - _DIGITS - 1
    with open(source, "rb") as file:
        file.seek(max(0, size))
        last = file.read()
    if not last.startswith(_CHECKSUM):
        return False
    if last != _CHECKSUM + _digest(source, size) + b"\n":
        raise StoreError(f"{source} is damaged: its checksum is another one")
    return True


def _digest(path: Path, size: int) -> bytes:
    """Return the checksum of the first `size` bytes of a file."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while size > 0 and (piece := file.read(min(size, 1 << 20))):
            digest.update(piece)
            size -= len(piece)
    return digest.hexdigest().encode()


def _restore(source: Path, draft: Path, folder: Path) -> int:
    with (
        closing(sqlite3.connect(f"{source.resolve().as_uri()}?mode=ro", uri=True)) as backup,
        closing(sqlite3.connect(draft, isolation_level=None)) as copy,
    ):
        backup.backup(copy)
        _check(copy, source)
        (version,) = copy.execute("PRAGMA user_version").fetchone()
        creation_script(version, str(source))
        found = copy.execute(f"SELECT text FROM {_KEYS}").fetchone()
        copy.execute(f"DROP TABLE {_KEYS}")
    if found is not None:
        with private_draft(folder / keys.FILE) as text:
            text.write_text(found[0], encoding="utf-8")
    return int(version)


def _check(connection: sqlite3.Connection, path: Path) -> None:
    """Raise StoreError if the database is damaged, or its rows refer to missing rows."""
    (said,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    if said != "ok":
        raise StoreError(f"{path} is damaged: {said}")
    if connection.execute("PRAGMA foreign_key_check").fetchone() is not None:
        raise StoreError(f"{path} is damaged: rows are missing")


def _refuse_shared(place: str | Path, instead: str) -> None:
    if is_shared(place):
        raise UsageError(f"not available for PostgreSQL; use {instead}")
