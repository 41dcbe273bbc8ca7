from __future__ import annotations

import json
import math

import pytest
from talk import Frame, Reply

from benchmarks.trial.fuzz import read
from benchmarks.trial.promises import Promises, improving, in_order
from benchmarks.trial.rows import Judgement, TrialRow, none_of, percentile, table, times


def frame(number: int, kind: str, **data: object) -> Frame:
    return Frame(number, kind, json.dumps(data))


def job(state: str = "succeeded", finished_at: str | None = "12:00") -> dict[str, object]:
    outcome = "optimal" if finished_at else None
    return {
        "id": "j",
        "state": state,
        "outcome": outcome,
        "finished_at": finished_at,
        "best": None,
        "plans": 1,
        "detail": "",
    }


@pytest.mark.parametrize(("share", "expected"), [(0.5, 5), (0.99, 10), (1.0, 10), (0.01, 1)])
def test_a_percentile_is_one_of_the_numbers(share: float, expected: float) -> None:
    assert percentile([10, 1, 2, 3, 4, 5, 6, 7, 8, 9], share) == expected


def test_nothing_measured_has_no_percentile_and_misses_the_goal() -> None:
    assert math.isnan(percentile([], 0.5))
    assert times("p", "r", [], 1.0).judgement is Judgement.MISSED


@pytest.mark.parametrize(("slowest", "expected"), [(0.05, Judgement.HELD), (0.051, Judgement.MISSED)])
def test_the_goal_is_for_the_slow_ones(slowest: float, expected: Judgement) -> None:
    assert times("p", "r", [0.01, slowest], 0.05).judgement is expected


def test_what_must_not_happen_is_missed_when_it_does() -> None:
    assert none_of("p", "r", 0).judgement is Judgement.HELD
    assert none_of("p", "r", 1).judgement is Judgement.MISSED


def test_the_table_has_a_line_for_each_row_and_the_documents_are_json() -> None:
    rows = [none_of("kills", "jobs lost", 0, " of 7"), TrialRow(part="a", requirement="b", figure="c")]
    assert [line.split() for line in table(rows).splitlines()[1:]] == [
        ["kills", "jobs", "lost", "0", "0", "of", "7", "held"],
        ["a", "b", "c"],
    ]
    assert json.loads(json.dumps(rows[0].document()))["judgement"] == "held"


def test_events_in_order_end_once_and_tell_of_each_revision() -> None:
    plan, end = frame(2, "plan", revision=1), frame(3, "end", outcome="optimal")
    state = frame(1, "state", state="queued")
    assert in_order([state, plan, end], job())
    assert not in_order([state, end, plan], job())
    assert not in_order([state, plan], job())
    assert not in_order([state, plan, end, frame(4, "end", outcome="optimal")], job())
    assert not in_order([state, frame(2, "plan", revision=2), end], job())
    assert not in_order([frame(2, "plan", revision=1), end], job())
    assert not in_order([state, plan, frame(3, "end", outcome="timeout")], job())


def test_revisions_have_to_get_better() -> None:
    assert improving([(9, 0, 0), (8, 5, 5), (8, 5, 4)])
    assert not improving([(9, 0, 0), (9, 0, 0)])
    assert not improving([(9, 0, 0), (8, 0, 0), (8, 1, 0)])


def test_a_job_that_ends_twice_is_noticed() -> None:
    promises = Promises()
    promises.acknowledge("key", Reply(202, "application/json", job("queued", None)))
    promises.see(job())
    promises.see(job())
    assert promises.ended_again == 0
    promises.see(job(finished_at="12:01"))
    assert promises.ended_again == 1


def test_a_key_that_makes_two_jobs_is_noticed() -> None:
    promises = Promises()
    promises.acknowledge("key", Reply(202, "application/json", job("queued", None)))
    promises.acknowledge("key", Reply(200, "application/json", job("queued", None)))
    assert promises.made_twice == 0
    promises.acknowledge("key", Reply(202, "application/json", {**job("queued", None), "id": "other"}))
    assert promises.made_twice == 1
    promises.acknowledge("key", Reply(500, "application/json", None))
    assert promises.odd.total() == 1


SUMMARY = """
Failures:
  ❌ ST108 SSE event violates schema: 1

Test cases:
  5325 generated, 6 found 6 unique failures
"""


def test_failures_are_read_from_what_schemathesis_prints() -> None:
    assert read(SUMMARY, 1) == (6, 5325, ["ST108 SSE event violates schema: 1"])
    assert read("  100 generated, 100 passed\n", 0) == (0, 100, [])
    assert read("no such file\n", 2) == (1, 0, [])
