"""`marsupial.plan`: improving, checked plans."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.planning.situations import one_room, out_of_reach, two_rooms

import marsupial
from marsupial.errors import EngineUnavailable, SituationError, UsageError
from marsupial.formats.pddl.text import problem_text
from marsupial.formats.situation import situation_to_json
from marsupial.planning.greedy import serve

PLAN = serve(two_rooms())[0]


class Scripted:
    """An engine that yields a script of events."""

    info = marsupial.EngineInfo(name="scripted")

    def __init__(self, *plans: marsupial.Plan) -> None:
        self._plans = plans
        self.closed = False

    def solve(self, *_: Any, **__: Any) -> Iterator[marsupial.Improved | marsupial.Finished]:
        try:
            for i, plan in enumerate(self._plans):
                yield marsupial.Improved(plan=plan, elapsed_s=float(i))
            yield marsupial.Finished(outcome=marsupial.Outcome.SATISFICING, lower_bound_ms=1)
        finally:
            self.closed = True


def test_plans_get_better_and_are_valid() -> None:
    plans = list(marsupial.plan(two_rooms(), steps=20))
    spans = [plan.makespan_ms for plan in plans]
    assert spans == sorted(spans, reverse=True)
    assert all(marsupial.check(two_rooms(), plan).valid for plan in plans)


def test_plans_that_are_no_better_or_invalid_are_left_out() -> None:
    broken = marsupial.Plan(actions=PLAN.actions[:1])
    found = marsupial.plan(two_rooms(), Scripted(broken, PLAN, PLAN))
    assert list(found) == [PLAN]
    assert [(p.best, p.violation is None) for p in found.proposals] == [(False, False), (True, True), (False, True)]
    assert found.best == PLAN
    assert found.finished.outcome is marsupial.Outcome.SATISFICING
    assert found.bound_ms is not None
    assert found.gap == pytest.approx(1 - found.bound_ms / PLAN.makespan_ms)
    assert repr(found) == f"<3 plans so far: makespan {PLAN.makespan_ms / 1000:g} s>"


def test_closing_the_iterator_ends_the_engine() -> None:
    engine = Scripted(PLAN, PLAN)
    found = marsupial.plan(two_rooms(), engine)
    assert next(found) == PLAN
    assert not engine.closed
    found.close()
    assert engine.closed
    assert list(found) == []


def test_without_a_plan_there_is_an_outcome() -> None:
    found = marsupial.plan(out_of_reach(), steps=3)
    assert list(found) == []
    assert (found.best, found.gap) == (None, None)
    assert found.finished.outcome in (marsupial.Outcome.UNSOLVABLE, marsupial.Outcome.NO_PLAN)


def test_a_situation_is_a_value_its_json_or_a_file(tmp_path: Path) -> None:
    situation = one_room()
    text = situation_to_json(situation)
    (tmp_path / "situation.json").write_text(text)
    (tmp_path / "problem.pddl").write_text(problem_text(situation))
    sources = [situation, json.loads(text), tmp_path / "situation.json", str(tmp_path / "problem.pddl")]
    found = [marsupial.plan(source, "greedy", steps=1) for source in sources]
    assert all(plans.situation == situation for plans in found)
    assert len({next(plans).makespan_ms for plans in found}) == 1


def test_errors_are_reported(tmp_path: Path) -> None:
    with pytest.raises(SituationError, match=r"nowhere\.json: no such file"):
        marsupial.plan(tmp_path / "nowhere.json")
    with pytest.raises(SituationError, match="robots"):
        marsupial.plan({"format": "marsupial situation", "version": 1})
    with pytest.raises(UsageError, match="unknown planner"):
        marsupial.plan(one_room(), "nobody")
    with pytest.raises(UsageError, match="must be positive"):
        marsupial.plan(one_room(), budget=0.0)
    with pytest.raises(EngineUnavailable, match="no executable"):
        next(marsupial.plan(one_room(), "cmd:no-such {domain} {problem}"))
