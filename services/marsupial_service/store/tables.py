"""The tables: jobs and missions, each with their events, and what belongs to one kind only.

The events of turn k of a mission are what it made of its first k inputs. They are stored together or not at all.
A row of theirs holds a whole turn, `seq` is the number of its last event; long ones are stored in parts, as inputs are
(`marsupial_service.store.packing`). `bytes` is about what an entry takes with all that belongs to it.
An entry that is being worked on has a `holder`, one of the `servers`, and its `term` counts those it has had: what a
holder of an earlier term writes comes too late. `owners` are those whose jobs were claimed; the one served longest ago
is next.

They are written in the words of SQLite; a database of an earlier version is brought up to date step by step.
"""

from __future__ import annotations

from collections.abc import Sequence

from marsupial_service.store.errors import StoreError


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
    finished_ms INTEGER
) STRICT;
CREATE UNIQUE INDEX {name}_by_key ON {name} (owner, idempotency_key) WHERE idempotency_key IS NOT NULL;
CREATE INDEX {name}_by_owner ON {name} (owner, number);
CREATE INDEX {name}_over ON {name} (finished_ms) WHERE finished_ms IS NOT NULL;
"""


def _events(name: str, entry: str, entries: str, own: str = "") -> str:
    """Return the table of the events of a table of entries."""
    return f"""
CREATE TABLE {name} (
    {entry} INTEGER NOT NULL REFERENCES {entries} (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,{own}
    type TEXT NOT NULL,
    data TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY ({entry}, seq)
) STRICT, WITHOUT ROWID;
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
    first_plan_ms INTEGER,""",
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
    turns INTEGER NOT NULL DEFAULT 0,""",
)

_OF_JOBS = """
CREATE INDEX jobs_open ON jobs (state, number) WHERE finished_ms IS NULL;
CREATE TABLE payloads (
    job INTEGER PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
    task BLOB,
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
"""

_OF_MISSIONS = """
CREATE INDEX missions_open ON missions (number) WHERE finished_ms IS NULL;
CREATE TABLE mission_briefs (
    mission INTEGER PRIMARY KEY REFERENCES missions (number) ON DELETE CASCADE,
    brief BLOB NOT NULL
) STRICT;
CREATE TABLE mission_inputs (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    digest BLOB,
    data BLOB NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq)
) STRICT, WITHOUT ROWID;
CREATE INDEX mission_events_by_turn ON mission_events (mission, turn, seq);
"""

_FIRST = "".join(
    (
        _JOBS,
        _events("events", "job", "jobs"),
        _OF_JOBS,
        _MISSIONS,
        _events("mission_events", "mission", "missions", "\n    turn INTEGER NOT NULL,"),
        _OF_MISSIONS,
    )
)

_SHARED = """
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
ALTER TABLE jobs ADD COLUMN claimed_ms INTEGER;
ALTER TABLE jobs ADD COLUMN spent_ms INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN holder TEXT;
ALTER TABLE jobs ADD COLUMN term INTEGER NOT NULL DEFAULT 0;
ALTER TABLE missions ADD COLUMN frame TEXT;
ALTER TABLE missions ADD COLUMN holder TEXT;
ALTER TABLE missions ADD COLUMN term INTEGER NOT NULL DEFAULT 0;
"""

ROW_BYTES = 40
"""What a row takes besides its contents, in what is counted as `bytes` of an entry."""

ENTRY_BYTES = 500
"""The same of an entry with its indexes."""


def _contents(table: str, entry: str, *columns: str) -> str:
    """Return an expression for the bytes of the rows of a table that belong to an entry of the outer statement."""
    lengths = " + ".join(f"coalesce(length({column}), 0)" for column in columns)
    return f"(SELECT coalesce(sum({ROW_BYTES} + {lengths}), 0) FROM {table} WHERE {entry} = number)"


_PACKED = f"""
CREATE TABLE packed_events (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    part INTEGER NOT NULL,
    turn INTEGER NOT NULL,
    data BLOB NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq, part)
) STRICT, WITHOUT ROWID;
INSERT INTO packed_events
    SELECT mission, seq, 0, turn, CAST(type || ' ' || data AS BLOB), at_ms FROM mission_events;
DROP TABLE mission_events;
ALTER TABLE packed_events RENAME TO mission_events;
CREATE INDEX mission_events_of_turn ON mission_events (mission, turn);
CREATE TABLE packed_inputs (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    part INTEGER NOT NULL,
    digest BLOB,
    data BLOB NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq, part)
) STRICT, WITHOUT ROWID;
INSERT INTO packed_inputs SELECT mission, seq, 0, digest, data, at_ms FROM mission_inputs;
DROP TABLE mission_inputs;
ALTER TABLE packed_inputs RENAME TO mission_inputs;
ALTER TABLE jobs ADD COLUMN bytes INTEGER NOT NULL DEFAULT {ENTRY_BYTES};
ALTER TABLE missions ADD COLUMN bytes INTEGER NOT NULL DEFAULT {ENTRY_BYTES};
UPDATE jobs SET bytes = bytes + {_contents("payloads", "job", "task", "source", "situation", "places")}
    + {_contents("plans", "job", "actions", "ipc")} + {_contents("events", "job", "data")};
UPDATE missions SET bytes = bytes + {_contents("mission_briefs", "mission", "brief")}
    + {_contents("mission_inputs", "mission", "digest", "data")} + {_contents("mission_events", "mission", "data")};
"""

_SIMULATED = """
ALTER TABLE missions ADD COLUMN simulation TEXT;
"""

_STEPS = (_FIRST, _SHARED, _PACKED, _SIMULATED)
"""What leads from each version to the next; 0 is a database without tables."""

VERSION = len(_STEPS)


def steps(version: int, place: str) -> Sequence[str]:
    """Return what leads from `version` to this one. Raises StoreError if that is a later one."""
    if not 0 <= version <= VERSION:
        raise StoreError(f"{place}: its tables have version {version}, this is for version {VERSION}")
    return _STEPS[version:]
