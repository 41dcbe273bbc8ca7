from __future__ import annotations

from benchmarks.trial.freezing import Point, after


def through(*statements: str) -> Point:
    point: Point = ()
    for sql in statements:
        point = after(point, sql)
    return point


def test_other_values_and_further_rounds_of_a_loop_are_no_new_point() -> None:
    once = through("BEGIN", "DELETE  FROM jobs\n WHERE id IN ($1)", "SELECT 1")
    assert once == ("BEGIN", "DELETE FROM jobs WHERE id IN (?)", "SELECT 1")
    assert after(after(once, "DELETE FROM jobs WHERE id IN ($1, $2)"), "SELECT 1") == once


def test_what_other_writes_of_the_same_commit_have_done_is_no_part_of_a_point() -> None:
    first = ("BEGIN", "SAVEPOINT errand", "SELECT 1", "RELEASE SAVEPOINT errand")
    assert through(*first, "SAVEPOINT errand", "SELECT 2") == ("BEGIN", "SAVEPOINT errand", "SELECT 2")
