from collections.abc import Callable
from contextlib import suppress

import misbehaving_planners
import psutil
import pytest
from support.planning.situations import (
    SOLVABLE,
    many_rooms,
    one_hall,
    one_room,
    out_of_reach,
    rover_left_behind,
    two_rooms,
)
from support.planning.spots import situation_of
from support.processes.process_tree import below_launcher
from support.waiting import HANG_S, doubling_budgets, wait_until

from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model.objective import MAKESPAN, Objective, ObjectiveName, PricedArrival
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.engines import ENGINES, PART_SIZES, engine, engine_infos, mission_engine
from marsupial.planning.external.aries import aries
from marsupial.planning.external.process_engine import ProcessEngine
from marsupial.planning.external.tamer import tamer
from marsupial.processes import launcher as processes
from marsupial.processes.jobs import GIB

pytestmark = pytest.mark.usefixtures("nothing_left")

AMPLE = Budget(seconds=HANG_S)
NEEDING_PROCESSES = ("aries", "tamer")
INFO = EngineInfo(name="test", summary="", licence="", anytime=True, proves_optimality=False, deterministic_steps=False)


def available(name: str) -> Engine:
    found = engine(name)
    if found.info.missing is not None:
        pytest.skip(f"{name}: {found.info.missing}")
    return found


def first_plan(solver: Engine, situation: Situation) -> Plan:
    events = solver.solve(situation, AMPLE)
    event = next(iter(events))
    close = getattr(events, "close", None)
    if close is not None:
        close()
    return event.plan


def improvements(
    solver: Engine, situation: Situation, seconds: float, objective: Objective = MAKESPAN
) -> tuple[list[Plan], Finished]:
    """Return the plans found within a short budget, doubled until there are some."""
    for budget in doubling_budgets(seconds):
        *improved, last = solver.solve(situation, Budget(seconds=budget), objective=objective)
        assert isinstance(last, Finished)
        plans = [event.plan for event in improved if isinstance(event, Improved)]
        assert len(plans) == len(improved)
        if plans:
            return plans, last
    raise AssertionError


@pytest.mark.parametrize("case", SOLVABLE)
@pytest.mark.parametrize("name", ENGINES)
def test_every_engine_finds_a_valid_plan_where_one_can_be_seen_by_eye(name: str, case: str) -> None:
    situation = SOLVABLE[case]()
    verdict = check(situation, first_plan(available(name), situation))
    assert verdict.valid, verdict.violation


COUNTING = [info.name for info in engine_infos() if info.deterministic_steps]
"""The engines that count steps."""


def after_steps(name: str, situation: Situation, steps: int = 20) -> list[Plan]:
    events = engine(name).solve(situation, Budget(steps=steps))
    return [event.plan for event in events if isinstance(event, Improved)]


@pytest.mark.parametrize("name", COUNTING)
def test_plans_by_steps_are_valid_and_ever_better(name: str) -> None:
    for make in SOLVABLE.values():
        plans = after_steps(name, make())
        assert plans
        assert all(check(make(), plan).valid for plan in plans)
        spans = [plan.makespan_ms for plan in plans]
        assert spans == sorted(set(spans), reverse=True)


@pytest.mark.parametrize(
    ("case", "best_ms"), [(one_hall, 30_001), (one_room, 19_002), (two_rooms, 72_007), (rover_left_behind, 59_004)]
)
@pytest.mark.parametrize("name", COUNTING)
def test_the_best_plan_is_found_by_steps_where_it_is_seen_by_eye(
    name: str, case: Callable[[], Situation], best_ms: int
) -> None:
    assert after_steps(name, case())[-1].makespan_ms == best_ms


@pytest.mark.parametrize("name", COUNTING)
def test_the_same_steps_give_the_same_plans(name: str) -> None:
    for situation in (many_rooms(6, 3, 20, 8), many_rooms(2, 2, 8, 6, seed=1)):
        assert after_steps(name, situation, 5) == after_steps(name, situation, 5)


@pytest.mark.parametrize("name", ENGINES)
def test_plans_get_better_and_one_end_comes_last(name: str) -> None:
    plans, last = improvements(available(name), one_room(), 0.8)
    makespans = [plan.makespan_ms for plan in plans]
    assert makespans == sorted(set(makespans), reverse=True)
    assert last.outcome in (Outcome.SATISFICING, Outcome.OPTIMAL)


OBJECTIVES: tuple[Objective, ...] = (MAKESPAN, PricedArrival(worth={"t1": 1.0, "t2": 3.0}, makespan=0.3, driving=0.15))


@pytest.mark.parametrize("objective", OBJECTIVES, ids=lambda objective: objective.name)
@pytest.mark.parametrize("name", ENGINES)
def test_plans_get_better_by_the_objective_or_the_engine_refuses_it(name: str, objective: Objective) -> None:
    asked, situation = available(name), one_hall()
    if objective.name not in asked.info.objectives:
        with pytest.raises(UsageError, match=f"{name} can't plan for {objective.name}"):
            list(asked.solve(situation, AMPLE, objective=objective))
        return
    plans, _ = improvements(asked, situation, 0.5, objective)
    values = [objective.value(situation, plan) for plan in plans]
    assert values == sorted(set(values), reverse=True)
    assert all(check(situation, plan).valid for plan in plans)


def test_every_engine_takes_the_makespan_and_those_of_local_search_priced_arrival() -> None:
    infos = {info.name: info for info in engine_infos()}
    assert all(ObjectiveName.MAKESPAN in info.objectives for info in infos.values())
    assert {name for name, info in infos.items() if ObjectiveName.PRICED_ARRIVAL in info.objectives} == {
        "anytime",
        "auto",
    }


@pytest.mark.parametrize("name", ENGINES)
def test_unreachable_targets_are_proven_unsolvable(name: str) -> None:
    (end,) = available(name).solve(out_of_reach(), AMPLE)
    assert end.outcome is Outcome.UNSOLVABLE
    assert "t2" in end.detail


@pytest.mark.parametrize("name", NEEDING_PROCESSES)
def test_where_nothing_is_to_do_the_empty_plan_is_optimal(name: str) -> None:
    nothing = situation_of([], {}, {}, {})
    improved, end = available(name).solve(nothing, AMPLE)
    assert improved.plan.actions == ()
    assert end.outcome is Outcome.OPTIMAL


@pytest.mark.parametrize("name", ENGINES)
def test_a_known_plan_comes_first(name: str) -> None:
    solver = available(name)
    known = first_plan(engine("greedy"), one_room())
    events = iter(solver.solve(one_room(), Budget(seconds=0.3), start=known))
    event = next(events)
    assert event.plan == known
    *_, last = events
    assert last.outcome in (Outcome.SATISFICING, Outcome.OPTIMAL)


@pytest.mark.parametrize(("case", "makespan_ms"), [(one_hall, 30_001), (one_room, 19_002), (two_rooms, 72_007)])
def test_aries_finds_ever_shorter_plans_and_none_shorter_than_is_possible(case: object, makespan_ms: int) -> None:
    assert callable(case)
    plans, _ = improvements(available("aries"), case(), 1.0)
    found = [plan.makespan_ms for plan in plans]
    assert found == sorted(set(found), reverse=True)
    assert found[-1] >= makespan_ms


@pytest.mark.parametrize("name", NEEDING_PROCESSES)
def test_these_engines_refuse_to_count_steps(name: str) -> None:
    with pytest.raises(UsageError, match="seconds"):
        available(name).solve(one_room(), Budget(steps=10))
    with pytest.raises(UsageError, match="seconds"):
        mission_engine(name, Budget(steps=10))


@pytest.mark.parametrize(("make", "distribution"), [(tamer, "up-tamer"), (aries, "up-aries")])
def test_an_engine_that_is_not_installed_names_the_package(make: object, distribution: str) -> None:
    assert callable(make)
    solver = make(lambda module: None if module.startswith("up_") else object())
    assert f"pip install {distribution}" in solver.info.missing
    with pytest.raises(EngineUnavailable, match=distribution):
        solver.solve(one_room(), AMPLE)


def test_an_engine_without_time_reports_a_timeout() -> None:
    (end,) = available("tamer").solve(many_rooms(6, 3, 20, 8), Budget(seconds=0.3))
    assert end.outcome is Outcome.TIMEOUT


def planner_processes() -> list[psutil.Process]:
    """Return the processes of the planner, without its supervisor, which is the first one."""
    return sorted(below_launcher(), key=lambda process: process.pid)[1:]


@pytest.mark.parametrize("name", NEEDING_PROCESSES)
def test_a_planner_killed_from_outside_has_its_own_outcome(name: str) -> None:
    situation = many_rooms(3, 2, 8, 4)
    events = available(name).solve(situation, AMPLE)
    for process in wait_until(planner_processes):
        with suppress(psutil.NoSuchProcess):
            process.kill()
    *_, end = events
    assert end.outcome is Outcome.KILLED


def test_an_aries_server_killed_from_outside_has_its_own_outcome() -> None:
    events = available("aries").solve(many_rooms(3, 2, 8, 4), AMPLE)
    server, *_ = wait_until(lambda: [process for process in planner_processes() if "serve" in process.cmdline()])
    server.kill()
    *_, end = events
    assert end.outcome is Outcome.KILLED
    assert "Aries server" in end.detail


def test_an_aries_server_that_panics_is_started_again() -> None:
    available("aries")
    plans, last = improvements(ProcessEngine(INFO, misbehaving_planners.aries_panicking_at_times, ()), one_room(), 0.8)
    assert plans
    assert last.outcome in (Outcome.SATISFICING, Outcome.OPTIMAL)


def test_an_aries_server_that_always_panics_is_a_crash() -> None:
    available("aries")
    solver = ProcessEngine(INFO, misbehaving_planners.aries_panicking_always, ())
    (end,) = solver.solve(one_room(), AMPLE)
    assert end.outcome is Outcome.CRASHED
    assert end.detail == "the Aries server ended with exit code 1"


def test_closing_early_ends_the_planner_at_once() -> None:
    events = available("aries").solve(many_rooms(3, 2, 8, 4), AMPLE)
    planner = wait_until(planner_processes)
    events.close()  # type: ignore[attr-defined]
    assert not any(process.is_running() for process in planner)


@pytest.mark.parametrize(
    ("search", "outcome"),
    [
        ("eat_memory", Outcome.MEMORY),
        ("never_answer", Outcome.TIMEOUT),
        ("segfault", Outcome.CRASHED),
        ("raise_error", Outcome.CRASHED),
        ("lose_its_tool", Outcome.KILLED),
        ("give_up", Outcome.NO_PLAN),
    ],
)
def test_each_end_of_a_planner_has_its_own_outcome(search: str, outcome: Outcome) -> None:
    memory = {"memory_bytes": GIB // 2} if outcome is Outcome.MEMORY else {}
    solver = ProcessEngine(INFO, getattr(misbehaving_planners, search), (), **memory)
    (end,) = solver.solve(one_room(), Budget(seconds=0.5) if outcome is Outcome.TIMEOUT else AMPLE)
    assert end.outcome is outcome


def test_a_crash_after_a_plan_is_still_a_crash() -> None:
    solver = ProcessEngine(INFO, misbehaving_planners.crash_after_a_plan, ())
    improved, end = solver.solve(one_hall(), AMPLE)
    assert isinstance(improved, Improved)
    assert end.outcome is Outcome.CRASHED


@pytest.mark.parametrize("name", PART_SIZES)
def test_missions_get_big_situations_planned_in_parts(name: str) -> None:
    situation = many_rooms(2, 2, 8, 4)
    available(name)
    plan = first_plan(mission_engine(name, AMPLE), situation)
    assert plan.explored
    assert check(situation, plan, targets=plan.explored).valid


def test_the_launcher_can_be_warmed_up_beforehand() -> None:
    processes.warm_up(wait=False)
    processes.warm_up()
    assert below_launcher() == []


def test_an_engine_without_wheels_for_this_python_gives_that_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.version_info", (3, 14, 0))
    missing = tamer(lambda module: None if module == "pytamer" else object()).info.missing
    assert missing == "not installed; pytamer has wheels for Python below 3.14 only"
