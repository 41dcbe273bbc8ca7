"""The embedded database: one SQLite file in a folder that only one server uses.

Write-ahead log, every commit on disk before it returns (`synchronous=FULL`), foreign keys held. The folder is made for
its owner alone: it holds maps and keys.
"""

import fcntl
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from marsupial.formats.files import reason
from marsupial_service.store import tables
from marsupial_service.store.engine import Connection, StoreBackend, StoreError, StoreInUse

FILE = "marsupial.sqlite"

# only maintenance writes besides the server: with a write-ahead log, readers block nobody
_BUSY_MS = 10_000
_LONGEST_LOG = 64 << 20  # bytes, to which the write-ahead log is cut after a checkpoint
# pages freed in one transaction, in some 10 ms
_FREED_PAGES = 500
# one page in so many may be free: it would be taken again soon, and freeing it means moving another
_SLACK = 50


class Sqlite(StoreBackend):
    """The file in `folder`, which is made if need be. Raises StoreInUse, StoreError.

    One that `for_maintenance` opens without creating or locking, also while a server runs.
    """

    begin = "BEGIN IMMEDIATE"
    begin_reading = "BEGIN"
    live = "SELECT id FROM servers"
    errors = (sqlite3.Error,)
    refusals = (sqlite3.IntegrityError, sqlite3.ProgrammingError)

    def __init__(self, folder: Path, *, for_maintenance: bool = False) -> None:
        super().__init__()
        self.path = folder / FILE
        self.place = str(self.path)
        self._lock: int | None = None
        if for_maintenance:
            return
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"can't make the folder {folder}: {reason(error)}") from error
        self._lock = lock_folder(folder / "lock")

    def writer(self) -> Connection:
        self._keep_private()
        return super().writer()

    def reader(self) -> sqlite3.Connection:
        connection = self._connect()
        connection.execute("PRAGMA query_only = ON")
        return connection

    def maintainer(self) -> Connection:
        if not self.path.exists():
            raise StoreError(f"{self.path.parent}: no store in this folder")
        return super().maintainer()

    def shrink(self, connection: Connection) -> bool:
        (pages,) = connection.execute("PRAGMA page_count").fetchone()
        (free,) = connection.execute("PRAGMA freelist_count").fetchone()
        excess: int = free - pages // _SLACK
        for _ in range(min(excess, _FREED_PAGES)):
            connection.execute("PRAGMA incremental_vacuum(1)")  # of more than one Python's module frees one only
        return excess > 0

    def checkpoint(self) -> bool:
        # copies the write-ahead log into the file, truncates the file, and empties the log
        with closing(self._connect()) as connection:
            connection.execute("PRAGMA busy_timeout = 0")  # the log can't be emptied while somebody reads
            (busy, _, _) = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
            return not busy

    def disk_bytes(self, connection: Connection) -> int:
        files = (self.path, self.path.with_name(f"{FILE}-wal"))
        return sum(file.stat().st_size for file in files if file.exists())

    def free_bytes(self, connection: Connection) -> int:
        free, page = (connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("freelist_count", "page_size"))
        return int(free * page)

    def version(self, connection: Connection) -> int:
        return int(connection.execute("PRAGMA user_version").fetchone()[0])

    def close(self) -> None:
        if self._lock is not None:
            os.close(self._lock)

    def _keep_private(self) -> None:
        """Make the file for its owner alone, whatever the folder and the umask allow: it holds maps and keys."""
        # SQLite gives the write-ahead log and its index the mode of the file
        try:
            os.close(os.open(self.path, os.O_CREAT | os.O_WRONLY, 0o600))
            for file in self.path.parent.glob(f"{FILE}*"):
                file.chmod(0o600)
        except OSError as error:
            raise StoreError(f"{self.path}: {error.strerror}") from error

    def _connect(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self.path, isolation_level=None, check_same_thread=False)
        connection.row_factory = sqlite3.Row
        connection.execute(f"PRAGMA busy_timeout = {_BUSY_MS}")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection

    def _prepare(self, connection: sqlite3.Connection) -> None:
        script = tables.creation_script(self.version(connection), self.place)
        # before the tables are created: later, this would rewrite the database
        connection.execute("PRAGMA auto_vacuum = INCREMENTAL")
        (mode,) = connection.execute("PRAGMA journal_mode = WAL").fetchone()
        if mode != "wal":
            raise StoreError(f"{self.path}: this file system does not support a write-ahead log")
        connection.execute(f"PRAGMA journal_size_limit = {_LONGEST_LOG}")
        if script:
            connection.executescript(f"BEGIN IMMEDIATE;{script}PRAGMA user_version = {tables.VERSION};COMMIT;")
        connection.execute("DELETE FROM servers WHERE id != ?", (self.server,))
        connection.execute("INSERT INTO servers VALUES (?, 0) ON CONFLICT DO NOTHING", (self.server,))


def lock_folder(path: Path) -> int:
    """Lock the file at `path`, made if need be, and return its descriptor (closing unlocks). Raises StoreInUse."""
    try:
        fd = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise StoreError(f"{path}: {error.strerror}") from error
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        holder = os.read(fd, 32).decode(errors="replace").strip() or "unknown"
        os.close(fd)
        raise StoreInUse(f"{path.parent} is in use by another server (process {holder})") from None
    os.ftruncate(fd, 0)
    os.write(fd, f"{os.getpid()}\n".encode())
    return fd


@contextmanager
def private_draft(target: Path) -> Iterator[Path]:
    """Provide a private file that becomes `target` on success, and is removed on failure."""
    draft = target.with_name(f"{target.name}.draft")
    try:
        os.close(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600))
        yield draft
        for path in (draft, draft.parent):  # the folder too, or the new name may be lost in a power cut
            descriptor = os.open(path, os.O_RDONLY)
            os.fsync(descriptor)
            os.close(descriptor)
        os.replace(draft, target)
    except OSError as error:
        raise StoreError(f"{target}: {error.strerror}") from error
    finally:
        with suppress(FileNotFoundError):
            draft.unlink()
