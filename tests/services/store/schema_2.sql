-- What a folder of version 2 was made by.
CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    owner TEXT NOT NULL,
    idempotency_key TEXT,
    digest BLOB NOT NULL,
    state TEXT NOT NULL,
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
    events INTEGER NOT NULL DEFAULT 0,
    created_ms INTEGER NOT NULL,
    finished_ms INTEGER
) STRICT;
CREATE UNIQUE INDEX jobs_by_key ON jobs (owner, idempotency_key) WHERE idempotency_key IS NOT NULL;
CREATE INDEX jobs_by_owner ON jobs (owner, number);
CREATE INDEX jobs_over ON jobs (finished_ms) WHERE finished_ms IS NOT NULL;

CREATE TABLE events (
    job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    type TEXT NOT NULL,
    data TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (job, seq)
) STRICT, WITHOUT ROWID;

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

CREATE TABLE missions (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    owner TEXT NOT NULL,
    idempotency_key TEXT,
    digest BLOB NOT NULL,
    state TEXT NOT NULL,
    name TEXT NOT NULL,
    strategy TEXT NOT NULL,
    planner TEXT NOT NULL,
    status TEXT,
    reason TEXT NOT NULL DEFAULT '',
    n INTEGER NOT NULL DEFAULT 0,
    t_ms INTEGER NOT NULL DEFAULT 0,
    revision INTEGER NOT NULL DEFAULT 0,
    inputs INTEGER NOT NULL DEFAULT 0,
    turns INTEGER NOT NULL DEFAULT 0,
    events INTEGER NOT NULL DEFAULT 0,
    created_ms INTEGER NOT NULL,
    finished_ms INTEGER
) STRICT;
CREATE UNIQUE INDEX missions_by_key ON missions (owner, idempotency_key) WHERE idempotency_key IS NOT NULL;
CREATE INDEX missions_by_owner ON missions (owner, number);
CREATE INDEX missions_over ON missions (finished_ms) WHERE finished_ms IS NOT NULL;

CREATE TABLE mission_events (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    turn INTEGER NOT NULL,
    type TEXT NOT NULL,
    data TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq)
) STRICT, WITHOUT ROWID;

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
