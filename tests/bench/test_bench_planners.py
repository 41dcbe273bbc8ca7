from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from support.planning.situations import one_room, two_rooms

from marsupial.bench import planners
from marsupial.bench.planner_report import RunRow, rows_of, table
from marsupial.bench.planners import BenchEngine, EngineRun, Round, deadline_s, improved, run
from marsupial.bench.suite.best import with_plan
from marsupial.bench.suite.catalogue import Instance
from marsupial.model import MAKESPAN, Budget, EngineInfo, Finished, Improved, Objective, Outcome, Plan, Situation
from marsupial.planning.greedy import Greedy

SATISFIED = Finished(outcome=Outcome.SATISFICING)


@dataclass
class Clock:
    """A clock that only tests advance."""

    now: float = 100.0

    def __call__(self) -> float:
        return self.now


@dataclass
class Scripted:
    """An engine with a script of events and their times in seconds; it records whether it was closed."""

    clock: Clock
    lines: tuple[tuple[float, Improved | Finished | Exception], ...]
    info: EngineInfo = Greedy.info
    closed: list[bool] = field(default_factory=list)

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        begun = self.clock.now
        try:
            for at, line in self.lines:
                self.clock.now = begun + at
                if isinstance(line, Exception):
                    raise line
                yield line
        finally:
            self.closed.append(True)


def instance_of(situation: Situation, name: str = "x-1x1-1") -> Instance:
    return Instance(name=name, team="1x1", targets=len(situation.targets), family="x", situation=lambda: situation)


def plan_for(situation: Situation, *, wait_ms: int = 0) -> Plan:
    """Return greedy's first plan with its last action delayed."""
    events = Greedy().solve(situation, Budget(steps=1))
    *others, last = next(event.plan for event in events if isinstance(event, Improved)).actions
    return Plan.of([*others, replace(last, start_ms=last.start_ms + wait_ms)])


def event_of(plan: Plan) -> Improved:
    return Improved(plan=plan, elapsed_s=0.0)


def measured(
    *lines: tuple[float, Improved | Finished | Exception],
    situation: Situation | None = None,
    budget_s: float = 1.0,
    name: str = "fake",
) -> EngineRun:
    clock = Clock()
    contender = BenchEngine(name=name, make=lambda _: Scripted(clock, lines), missing=None)
    return run(instance_of(situation or one_room()), contender, budget_s, clock)


def row_of(*runs: EngineRun, known: Plan | None = None, situation: Situation | None = None) -> RunRow:
    """Return the row of the first run."""
    situation = situation or one_room()
    best = None if known is None else with_plan(None, situation, known, "somebody")
    return RunRow(Round(instance=instance_of(situation), best=improved(best, situation, runs), runs=runs), runs[0])


def test_plans_are_timed_when_they_come() -> None:
    slow, quick = plan_for(one_room(), wait_ms=500), plan_for(one_room())
    done = measured((0.25, event_of(slow)), (0.5, event_of(quick)), (0.75, SATISFIED))
    assert [(arrival.elapsed_s, arrival.makespan_ms) for arrival in done.arrivals] == [
        (0.25, slow.makespan_ms),
        (0.5, quick.makespan_ms),
    ]
    assert (done.plan, done.finished, done.wall_s) == (quick, SATISFIED, 0.75)


def test_a_plan_after_the_deadline_does_not_count_and_the_engine_is_closed() -> None:
    clock = Clock()
    plan = plan_for(one_room())
    engine = Scripted(clock, ((deadline_s(1.0) + 0.125, event_of(plan)), (5.0, SATISFIED)))
    done = run(instance_of(one_room()), BenchEngine(name="fake", make=lambda _: engine, missing=None), 1.0, clock)
    assert (done.plan, done.late, done.finished) == (None, 1, None)
    assert engine.closed == [True]
    assert done.wall_s < 5.0
    row = row_of(done)
    assert row.over_s == pytest.approx(deadline_s(1.0) + 0.125 - 1.0)
    assert row.outcome == "stopped, 1 late"


def test_a_plan_on_its_way_at_the_end_of_the_budget_counts() -> None:
    assert 1.0 < deadline_s(1.0) < 1.05
    done = measured((deadline_s(1.0) - 0.001, event_of(plan_for(one_room()))), (deadline_s(1.0) - 0.001, SATISFIED))
    assert done.plan is not None


def test_plans_the_checker_refuses_are_counted_and_not_used() -> None:
    plan = plan_for(one_room())
    broken = Plan.of([*plan.actions[:-1], replace(plan.actions[-1], duration_ms=1)])
    done = measured((0.1, event_of(broken)), (0.2, event_of(plan)), (0.3, event_of(broken)), (0.4, SATISFIED))
    assert (done.plan, done.refused, len(done.arrivals)) == (plan, 2, 1)
    assert "2 INVALID" in row_of(done).outcome


def test_a_plan_for_some_targets_is_no_solution_but_is_reported() -> None:
    situation = two_rooms()
    part = plan_for(situation.restricted(targets=frozenset({situation.targets[0].name})))
    done = measured((0.1, event_of(part)), (0.2, SATISFIED), situation=situation)
    assert (done.plan, done.served, done.refused) == (None, 1, 0)
    assert f"1/{len(situation.targets)} targets" in row_of(done, situation=situation).outcome


def test_an_engine_that_breaks_is_a_result() -> None:
    plan = plan_for(one_room())
    done = measured((0.1, event_of(plan)), (0.2, RuntimeError("oh dear")))
    assert done.plan == plan
    assert row_of(done).outcome == "crashed: RuntimeError: oh dear"


def test_the_ratio_is_to_the_best_plan_known() -> None:
    best = plan_for(one_room())
    slow = plan_for(one_room(), wait_ms=best.makespan_ms)
    row = row_of(measured((0.1, event_of(slow)), (0.2, SATISFIED)), known=best)
    assert (row.ratio, row.first_s, row.close_s) == (2.0, pytest.approx(0.1), None)
    assert row.behind is False


def test_a_better_plan_of_the_run_is_the_best_known() -> None:
    best, slow = plan_for(one_room()), plan_for(one_room(), wait_ms=1_000)
    quick = measured((0.5, event_of(best)), (0.6, SATISFIED), name="quick")
    behind = measured((0.1, event_of(slow)), (0.2, SATISFIED), name="slow")
    row = row_of(behind, quick, known=slow)
    assert row.best_ms == best.makespan_ms
    assert row.round.best.found_by == "quick"
    assert row.behind
    assert not row_of(quick, behind, known=slow).behind


def test_only_engines_with_the_same_budget_are_compared() -> None:
    best, slow = plan_for(one_room()), plan_for(one_room(), wait_ms=1_000)
    long = measured((0.5, event_of(best)), (0.6, SATISFIED), budget_s=10.0)
    assert not row_of(measured((0.1, event_of(slow)), (0.2, SATISFIED)), long).behind


def test_an_engine_without_a_plan_is_behind_one_with_a_plan_only() -> None:
    nothing = measured((0.1, Finished(outcome=Outcome.NO_PLAN)))
    assert not row_of(nothing, nothing).behind
    assert row_of(nothing, measured((0.1, event_of(plan_for(one_room()))), (0.2, SATISFIED), name="other")).behind


def test_the_time_to_a_plan_close_to_the_best_is_that_of_the_first_such_plan() -> None:
    best = plan_for(one_room())
    near, far = (plan_for(one_room(), wait_ms=best.makespan_ms * percent // 1000) for percent in (9, 12))
    row = row_of(measured((0.1, event_of(far)), (0.2, event_of(near)), (0.3, event_of(best)), (0.4, SATISFIED)))
    assert row.close_s == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("outcome", "bound", "at_s", "proven", "gap", "kept"),
    [
        (Outcome.OPTIMAL, 1.0, 0.2, True, 0.0, 1.0),
        (Outcome.OPTIMAL, None, 0.2, True, 0.0, 0.0),  # used in its run, but not stored
        (Outcome.OPTIMAL, 1.0, 2.0, False, None, 1.0),  # after the deadline
        (Outcome.SATISFICING, 0.75, 0.2, False, pytest.approx(0.25, abs=1e-3), 0.75),
    ],
)
def test_a_makespan_that_meets_its_bound_in_time_is_proven(
    outcome: Outcome, bound: float | None, at_s: float, proven: bool, gap: Any, kept: float
) -> None:
    plan = plan_for(one_room())
    end = Finished(outcome=outcome, lower_bound_ms=None if bound is None else int(bound * plan.makespan_ms))
    row = row_of(measured((0.1, event_of(plan)), (at_s, end)))
    assert (row.proven, row.gap, row.refuted) == (proven, gap, False)
    assert row.round.best.lower_bound_ms == int(kept * plan.makespan_ms)


def test_a_bound_that_a_plan_refutes_is_shown_and_not_kept() -> None:
    best, slow = plan_for(one_room()), plan_for(one_room(), wait_ms=1_000)
    wrong = Finished(outcome=Outcome.OPTIMAL, lower_bound_ms=slow.makespan_ms)
    row = row_of(measured((0.1, event_of(slow)), (0.2, wrong)), known=best)
    assert (row.refuted, row.proven) == (True, False)
    assert row.outcome == "optimal, REFUTED"
    assert row.round.best.lower_bound_ms == 0


def test_a_round_has_a_run_for_every_engine_and_budget() -> None:
    chosen = planners.contenders(["greedy", "anytime"])
    told: list[EngineRun] = []
    last = planners.play(instance_of(one_room()), chosen, (0.05, 0.1), None, told.append)
    assert tuple(told) == last.runs
    assert [(done.engine, done.budget_s) for done in last.runs] == [
        ("greedy", 0.05), ("anytime", 0.05), ("greedy", 0.1), ("anytime", 0.1)
    ]  # fmt: skip
    assert [(row.run.engine, row.run.budget_s) for row in rows_of([last])] == [
        ("anytime", 0.05), ("anytime", 0.1), ("greedy", 0.05), ("greedy", 0.1)
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("walls_s", "runs"), [((5.0, 0.1), 1 + len(planners.WARM_UP)), ((5.0,), planners.WARM_UPS * len(planners.WARM_UP))]
)
def test_an_engine_is_warm_once_it_keeps_its_budget(walls_s: tuple[float, ...], runs: int) -> None:
    clock = Clock()
    asked: list[float] = []

    def make(budget_s: float) -> Scripted:
        asked.append(budget_s)
        wall_s = walls_s[min(len(asked), len(walls_s)) - 1]
        return Scripted(clock, ((wall_s, SATISFIED),))

    planners.warm_up(BenchEngine(name="fake", make=make, missing=None), clock)
    assert len(asked) == runs


def test_the_table_has_every_run_a_summary_by_size_and_who_is_missing() -> None:
    done = measured((0.1, event_of(plan_for(one_room()))), (0.2, SATISFIED))
    other = replace(done, engine="other", plan=None, arrivals=())
    small = Round(instance=instance_of(one_room()), best=improved(None, one_room(), [done]), runs=(done, other))
    big = replace(small, instance=replace(small.instance, name="y-9x3-1", team="9x3"))
    absent = BenchEngine(name="ghost", make=lambda _: Greedy(), missing="not installed")
    lines = table(rows_of([small, big]), [absent]).splitlines()
    assert sum(line.startswith("  fake ") for line in lines) == 4
    assert "summary, up to 24 robots: 1 instances" in lines
    assert "summary, more than 24 robots: 1 instances" in lines
    assert lines[-1] == "ghost: not available, not installed"
    (heads,) = {line for line in lines if "mean ratio" in line}
    summary = [line.split() for line in lines[lines.index(heads) + 1 :] if line.startswith("  other ")]
    assert all(words[2:6] == ["0%", "-", "-", "0%"] and words[7] == "1" for words in summary)
