"""The tables: jobs and missions, each with their events, and the tables specific to one kind.

The events of batch k of a mission are its answer to input k (batch 0: to its brief). They are stored together or not at
all: one row holds a whole batch, and `seq` is the number of its last event. Long rows are stored in parts, like inputs
(`marsupial_service.store.packing`). `bytes` is the approximate size of an entry with all its rows.
An active entry has a `holder`, one of the `servers`, and its `term` counts the holders so far: the store ignores writes
by the holder of an earlier term. `owners` are those whose jobs were claimed; the one served longest ago is next. The
`version` of a mission is that of the code that runs it; an open one has a `reason` if a server could not continue it.

They are written in the SQL of SQLite; `postgres` translates it.
"""

from marsupial_service.store.engine import StoreError

# bytes counted for a row in addition to its contents; and for an entry with its indexes
ROW_BYTES = 40
ENTRY_BYTES = 500


def _entries(name: str, own: str) -> str:
    """Return a table of entries, with the columns that are its own, and how entries are looked up."""
    return f"""
CREATE TABLE {name} (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    owner TEXT NOT NULL,
    idempotency_key TEXT,
    digest BLOB NOT NULL,
    state TEXT NOT NULL,{own}
    events INTEGER NOT NULL DEFAULT 0,
    created_ms INTEGER NOT NULL,
    finished_ms INTEGER,
    holder TEXT,
    term INTEGER NOT NULL DEFAULT 0,
    bytes INTEGER NOT NULL DEFAULT {ENTRY_BYTES}
) STRICT;
CREATE UNIQUE INDEX {name}_by_key ON {name} (owner, idempotency_key) WHERE idempotency_key IS NOT NULL;
CREATE INDEX {name}_by_owner ON {name} (owner, number);
CREATE INDEX {name}_over ON {name} (finished_ms) WHERE finished_ms IS NOT NULL;
"""


_JOBS = _entries(
    "jobs",
    """
    planner TEXT NOT NULL,
    seconds REAL,
    steps INTEGER,
    outcome TEXT,
    detail TEXT NOT NULL DEFAULT '',
    attempts INTEGER NOT NULL DEFAULT 0,
    plans INTEGER NOT NULL DEFAULT 0,
    lower_bound_ms INTEGER,
    queued_ms INTEGER NOT NULL,
    started_ms INTEGER,
    first_plan_ms INTEGER,
    claimed_ms INTEGER,
    spent_ms INTEGER NOT NULL DEFAULT 0,""",
)

_MISSIONS = _entries(
    "missions",
    """
    name TEXT NOT NULL,
    strategy TEXT NOT NULL,
    planner TEXT NOT NULL,
    status TEXT,
    reason TEXT NOT NULL DEFAULT '',
    n INTEGER NOT NULL DEFAULT 0,
    t_ms INTEGER NOT NULL DEFAULT 0,
    revision INTEGER NOT NULL DEFAULT 0,
    inputs INTEGER NOT NULL DEFAULT 0,
    batches INTEGER NOT NULL DEFAULT 0,
    frame TEXT,
    simulation TEXT,
    version TEXT NOT NULL DEFAULT '',""",
)

SCHEMA = f"""{_JOBS}{_MISSIONS}
CREATE INDEX jobs_open ON jobs (state, number) WHERE finished_ms IS NULL;
CREATE TABLE events (
    job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    type TEXT NOT NULL,
    data TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (job, seq)
) STRICT, WITHOUT ROWID;
CREATE TABLE payloads (
    job INTEGER PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
    source BLOB NOT NULL,
    situation TEXT,
    places TEXT
) STRICT;
CREATE TABLE plans (
    job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
    revision INTEGER NOT NULL,
    makespan_ms INTEGER NOT NULL,
    score TEXT NOT NULL,
    found_after_ms INTEGER NOT NULL,
    at_ms INTEGER NOT NULL,
    actions TEXT NOT NULL,
    ipc TEXT NOT NULL,
    PRIMARY KEY (job, revision)
) STRICT, WITHOUT ROWID;
CREATE INDEX missions_open ON missions (number) WHERE finished_ms IS NULL;
CREATE TABLE mission_briefs (
    mission INTEGER PRIMARY KEY REFERENCES missions (number) ON DELETE CASCADE,
    brief BLOB NOT NULL
) STRICT;
CREATE TABLE mission_inputs (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    part INTEGER NOT NULL,
    digest BLOB,
    data BLOB NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq, part)
) STRICT, WITHOUT ROWID;
CREATE TABLE mission_events (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    part INTEGER NOT NULL,
    batch INTEGER NOT NULL,
    data BLOB NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq, part)
) STRICT, WITHOUT ROWID;
CREATE INDEX mission_events_of_batch ON mission_events (mission, batch);
CREATE TABLE servers (
    id TEXT PRIMARY KEY,
    beat_s REAL NOT NULL
) STRICT;
CREATE TABLE owners (
    name TEXT PRIMARY KEY,
    served INTEGER NOT NULL
) STRICT;
CREATE TABLE documents (
    name TEXT PRIMARY KEY,
    text TEXT NOT NULL
) STRICT;
"""

# 0 is a database without tables
VERSION = 5


def creation_script(version: int, place: str) -> str:
    """Return the SQL that creates missing tables. Raises StoreError if there are tables of another version."""
    if version not in (0, VERSION):
        raise StoreError(f"{place}: its tables have version {version}, version {VERSION} is required")
    return "" if version else SCHEMA
