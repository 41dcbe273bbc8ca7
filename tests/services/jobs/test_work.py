import json
import zlib
from dataclasses import replace

import pytest
from support.planning.situations import job_source, one_room

from marsupial.formats.situation import situation_in
from marsupial.model import Budget, Finished, Improved, Outcome, Plan
from marsupial.planning.checker import check
from marsupial.planning.engines import ENGINES
from marsupial.planning.greedy import serve
from marsupial_service.examples.demos import DEMOS
from marsupial_service.jobs.records import Closed, Found, WorkerTask
from marsupial_service.jobs.work import PLANNERS, checked, solve
from marsupial_service.schemas.enums import JobOutcome
from marsupial_service.settings import ServiceLimits

GOOD, _ = serve(one_room())
SHIFTED = Plan(actions=tuple(replace(action, start_ms=action.start_ms + 500) for action in GOOD.actions))
WRONG = Plan(actions=GOOD.actions[1:])


def outcome(*plans: Plan, end: Outcome) -> tuple[list[int], JobOutcome]:
    """Return the reported makespans and the outcome."""
    steps = [*(Improved(plan=plan, elapsed_s=0.0) for plan in plans), Finished(outcome=end, detail="so it says")]
    *found, closed = checked(iter(steps), one_room(), None)
    return [one.makespan_ms for one in found if isinstance(one, Found)], closed.outcome


def test_only_valid_and_better_plans_are_reported() -> None:
    best = GOOD.makespan_ms
    assert outcome(SHIFTED, SHIFTED, WRONG, GOOD, SHIFTED, end=Outcome.SATISFICING)[0] == [best + 500, best]


@pytest.mark.parametrize(
    ("plans", "end", "expected"),
    [
        ([GOOD], Outcome.OPTIMAL, JobOutcome.OPTIMAL),
        ([GOOD], Outcome.TIMEOUT, JobOutcome.SATISFICING),
        ([GOOD], Outcome.UNSOLVABLE, JobOutcome.SATISFICING),
        ([GOOD], Outcome.CRASHED, JobOutcome.ENGINE_FAILED),
        ([GOOD, WRONG], Outcome.OPTIMAL, JobOutcome.SATISFICING),
        ([WRONG], Outcome.OPTIMAL, JobOutcome.ENGINE_FAILED),
        ([], Outcome.OPTIMAL, JobOutcome.ENGINE_FAILED),
        ([], Outcome.SATISFICING, JobOutcome.ENGINE_FAILED),
        ([], Outcome.UNSOLVABLE, JobOutcome.UNSOLVABLE),
        ([], Outcome.MEMORY, JobOutcome.OUT_OF_MEMORY),
        ([], Outcome.NO_PLAN, JobOutcome.NO_PLAN),
    ],
)
def test_claims_of_a_planner_count_only_if_its_plans_support_them(
    plans: list[Plan], end: Outcome, expected: JobOutcome
) -> None:
    assert outcome(*plans, end=end)[1] is expected


def test_planners_to_warm_up_exist_and_get_work() -> None:
    assert set(PLANNERS) <= set(ENGINES)
    situation = situation_in(DEMOS["tiny"].load())
    plan, left = serve(situation)
    assert not left
    assert check(situation, plan).valid


def work_on(source: dict[str, object], **limits: int) -> list[object]:
    packed = zlib.compress(json.dumps(source).encode())
    asked = WorkerTask(source=packed, limits=ServiceLimits(**limits), engine="greedy", budget=Budget(steps=1))
    return list(solve(asked))


def test_the_worker_reads_the_request() -> None:
    *found, closed = work_on(job_source(one_room()))
    assert [type(one) for one in found] == [Found]
    assert isinstance(closed, Closed)
    assert closed.outcome is JobOutcome.SATISFICING


def test_a_job_beyond_lowered_limits_ends_with_the_reason() -> None:
    (closed,) = work_on(job_source(one_room()), places=1)
    assert isinstance(closed, Closed)
    assert closed.outcome is JobOutcome.INVALID_INPUT
    assert "more than the limit of 1" in closed.detail
