"""The tables of missions: what went into each, and what came out of it, in their order.

The events of turn k are what the mission made of its first k inputs. They are stored together or not at all.
"""

from __future__ import annotations

TABLES = """
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
"""
