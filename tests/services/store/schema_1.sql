CREATE TABLE events (
    job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    type TEXT NOT NULL,
    data TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (job, seq)
) STRICT, WITHOUT ROWID;
CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    owner TEXT NOT NULL,
    idempotency_key TEXT,
    digest BLOB NOT NULL,
    planner TEXT NOT NULL,
    seconds REAL,
    steps INTEGER,
    state TEXT NOT NULL,
    outcome TEXT,
    detail TEXT NOT NULL DEFAULT '',
    attempts INTEGER NOT NULL DEFAULT 0,
    plans INTEGER NOT NULL DEFAULT 0,
    events INTEGER NOT NULL DEFAULT 0,
    lower_bound_ms INTEGER,
    created_ms INTEGER NOT NULL,
    queued_ms INTEGER NOT NULL,
    started_ms INTEGER,
    first_plan_ms INTEGER,
    finished_ms INTEGER
) STRICT;
CREATE UNIQUE INDEX jobs_by_key ON jobs (owner, idempotency_key) WHERE idempotency_key IS NOT NULL;
CREATE INDEX jobs_by_owner ON jobs (owner, number);
CREATE INDEX jobs_open ON jobs (state, number) WHERE finished_ms IS NULL;
CREATE INDEX jobs_over ON jobs (finished_ms) WHERE finished_ms IS NOT NULL;
CREATE TABLE mission_briefs (
    mission INTEGER PRIMARY KEY REFERENCES missions (number) ON DELETE CASCADE,
    brief BLOB NOT NULL
) STRICT;
CREATE TABLE mission_events (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    turn INTEGER NOT NULL,
    type TEXT NOT NULL,
    data TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq)
) STRICT, WITHOUT ROWID;
CREATE INDEX mission_events_by_turn ON mission_events (mission, turn, seq);
CREATE TABLE mission_inputs (
    mission INTEGER NOT NULL REFERENCES missions (number) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    digest BLOB,
    data BLOB NOT NULL,
    at_ms INTEGER NOT NULL,
    PRIMARY KEY (mission, seq)
) STRICT, WITHOUT ROWID;
CREATE TABLE missions (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    owner TEXT NOT NULL,
    idempotency_key TEXT,
    digest BLOB NOT NULL,
    name TEXT NOT NULL,
    strategy TEXT NOT NULL,
    planner TEXT NOT NULL,
    state TEXT NOT NULL,
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
CREATE INDEX missions_open ON missions (number) WHERE finished_ms IS NULL;
CREATE INDEX missions_over ON missions (finished_ms) WHERE finished_ms IS NOT NULL;
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
