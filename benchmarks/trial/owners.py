"""The database itself records which server writes for a mission, independent of what servers believe.

Triggers record each change of a mission's owner, and the server connection that stored each of its turns.
"""

from __future__ import annotations

from typing import NamedTuple

import psycopg

_ACCOUNTS = """
CREATE TABLE trial_terms (mission BIGINT, term BIGINT, holder TEXT);
CREATE TABLE trial_turns (mission BIGINT, owned BOOLEAN);
CREATE FUNCTION trial_term() RETURNS trigger AS $$ BEGIN
    INSERT INTO trial_terms VALUES (NEW.number, NEW.term, NEW.holder); RETURN NULL;
END $$ LANGUAGE plpgsql;
CREATE FUNCTION trial_turn() RETURNS trigger AS $$ BEGIN
    INSERT INTO trial_turns SELECT NEW.mission, current_setting('application_name') = 'marsupial ' || left(holder, 8)
        FROM missions WHERE number = NEW.mission;
    RETURN NULL;
END $$ LANGUAGE plpgsql;
CREATE TRIGGER trial_term AFTER UPDATE OF term ON missions FOR EACH ROW EXECUTE FUNCTION trial_term();
CREATE TRIGGER trial_turn AFTER INSERT ON mission_events FOR EACH ROW EXECUTE FUNCTION trial_turn();
"""


class Ownership(NamedTuple):
    """The number of turns stored, and of those stored by a server that did not own their mission.

    `terms` counts how often a mission got an owner, `disputed` the terms that did not follow the one before, or had
    two owners.
    """

    turns: int
    foreign: int
    terms: int
    disputed: int


def keep_account(url: str) -> None:
    """Install the triggers; the service's tables must exist."""
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute(_ACCOUNTS)


def ownership(url: str) -> Ownership:
    """Return the counts so far."""
    turns = "SELECT count(*), count(*) FILTER (WHERE owned IS NOT TRUE) FROM trial_turns"
    terms = (
        "SELECT count(*), count(*) - count(DISTINCT (mission, term))"
        " + (SELECT coalesce(sum(last - terms), 0) FROM"
        " (SELECT max(term) AS last, count(DISTINCT term) AS terms FROM trial_terms GROUP BY mission) AS of_missions)"
        " FROM trial_terms"
    )
    with psycopg.connect(url) as connection:
        found = [connection.execute(sql).fetchone() or (0, 0) for sql in (turns, terms)]
    return Ownership(*(int(number) for row in found for number in row))
