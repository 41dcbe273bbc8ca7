import hashlib
from collections import Counter
from dataclasses import replace

import pytest
from support.planning.situations import one_room

from benchmarks.floors import FLOORS
from marsupial.bench.suite.best import (
    Best,
    better,
    digest_of,
    known_best,
    read_best,
    verified,
    with_bound,
    with_plan,
    write_best,
)
from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.errors import InputError, InvalidPlanError
from marsupial.formats.situation import situation_from_json, situation_to_json
from marsupial.model import Action, ActionName, Budget, Improved, Plan, Role, Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy

BEST = known_best()


def test_drawn_instances_are_those_that_their_floors_draw() -> None:
    drawn = [floor for floors in FLOORS.values() for floor in floors]
    for instance, floor in zip(INSTANCES.values(), drawn, strict=False):
        if floor.targets < 50:
            assert digest_of(floor.situation()) == BEST[instance.name].digest


def greedy_plan(situation: Situation) -> Plan:
    return next(event.plan for event in Greedy().solve(situation, Budget(steps=1)) if isinstance(event, Improved))


def later(plan: Plan, ms: int) -> Plan:
    """Return the plan with its last action delayed."""
    *others, last = plan.actions
    return Plan.of([*others, replace(last, start_ms=last.start_ms + ms)])


def test_the_suite_reaches_from_two_robots_to_a_hundred_and_thirty_six() -> None:
    sizes = Counter((instance.team, instance.targets) for instance in INSTANCES.values())
    assert sizes[("1x1", 3)] >= 2
    assert sizes[("2x2", 8)] >= 6
    assert sizes[("34x3", 150)] == 3
    families = {instance.family for instance in INSTANCES.values()}
    assert families == {"rooms", "two-doors", "pressure", "homes", "in-flight", "missions"}


@pytest.mark.parametrize("name", INSTANCES)
def test_an_instance_matches_its_name_and_never_changes(name: str) -> None:
    instance = INSTANCES[name]
    situation = instance.situation()
    roles = Counter(situation.type_by_name[robot.type].role for robot in situation.robots)
    carriers, rovers = (int(number) for number in instance.team.split("x"))
    assert (roles[Role.CARRIER], roles[Role.ROVER]) == (carriers, carriers * rovers)
    assert len(situation.targets) == instance.targets
    assert name.endswith(f"-{instance.team}-{instance.targets}")
    assert digest_of(situation) == BEST[name].digest, "the situation is not the one the best plan known is for"


@pytest.mark.parametrize("name", INSTANCES)
def test_the_best_plan_known_is_accepted_and_has_the_recorded_makespan(name: str) -> None:
    situation, best = INSTANCES[name].situation(), BEST[name]
    plan = best.read_plan(situation)
    verdict = check(situation, plan)
    assert verdict.valid, verdict.violation
    assert verdict.makespan_ms == best.makespan_ms
    assert 0 <= best.lower_bound_ms <= best.makespan_ms
    assert bool(best.lower_bound_ms) == bool(best.bound_by)


def test_best_plans_are_known_for_the_instances_of_the_suite_and_no_others() -> None:
    assert BEST.keys() == INSTANCES.keys()


def test_a_digest_depends_on_the_situation_and_survives_a_round_trip() -> None:
    situation = INSTANCES["homes-2x2-8"].situation()
    assert digest_of(situation_from_json(situation_to_json(situation))) == digest_of(situation)
    assert digest_of(replace(situation, goal=SituationGoal())) != digest_of(situation)
    assert digest_of(situation) == hashlib.sha256(situation_to_json(situation).encode()).hexdigest()[:16]


def test_only_a_shorter_plan_replaces_the_best_one() -> None:
    situation = one_room()
    plan = greedy_plan(situation)
    slow = with_plan(None, situation, later(plan, 5), "slow")
    assert (slow.makespan_ms, slow.found_by) == (plan.makespan_ms + 5, "slow")
    assert with_plan(slow, situation, later(plan, 5), "other") is slow
    assert with_plan(slow, situation, later(plan, 6), "other") is slow
    best = with_plan(slow, situation, plan, "quick")
    assert (best.makespan_ms, best.found_by) == (plan.makespan_ms, "quick")
    assert best.read_plan(situation) == plan


def test_only_a_higher_bound_that_no_plan_refutes_replaces_one() -> None:
    situation = one_room()
    plan = greedy_plan(situation)
    known = with_bound(with_plan(None, situation, plan, "a"), 1_000, "b")
    assert (known.lower_bound_ms, known.bound_by, known.optimal) == (1_000, "b", False)
    assert with_bound(known, 1_000, "c") is known
    assert with_bound(known, plan.makespan_ms + 1, "c") is known
    assert with_bound(known, plan.makespan_ms, "c").optimal


def test_a_shorter_plan_keeps_a_bound_below_it_and_drops_one_above() -> None:
    situation = one_room()
    plan = greedy_plan(situation)
    slow = with_plan(None, situation, later(plan, 5), "a")
    kept = with_plan(with_bound(slow, plan.makespan_ms, "b"), situation, plan, "c")
    assert (kept.lower_bound_ms, kept.bound_by, kept.optimal) == (plan.makespan_ms, "b", True)
    refuted = with_plan(with_bound(slow, plan.makespan_ms + 1, "b"), situation, plan, "c")
    assert (refuted.lower_bound_ms, refuted.bound_by) == (0, "")


def test_an_invalid_plan_or_one_for_another_situation_is_not_taken() -> None:
    situation = one_room()
    plan = greedy_plan(situation)
    known = with_plan(None, situation, plan, "a")
    with pytest.raises(InvalidPlanError, match="t1 has not been explored"):
        with_plan(known, situation, Plan.of(plan.actions[:-1]), "b")
    other = replace(situation, homes=(), robots=tuple(replace(robot, home=None) for robot in situation.robots),
                    travel_ms={name: table[:-1, :-1] for name, table in situation.travel_ms.items()})  # fmt: skip
    with pytest.raises(InvalidPlanError, match="another situation"):
        with_plan(known, other, plan, "b")


def test_of_two_files_the_shorter_plan_and_the_higher_bound_are_kept() -> None:
    situation = one_room()
    plan = greedy_plan(situation)
    slow = with_bound(with_plan(None, situation, later(plan, 5), "a"), 2_000, "b")
    quick = with_bound(with_plan(None, situation, plan, "c"), 1_000, "d")
    both = with_bound(quick, 2_000, "b")
    assert better(slow, quick) == better(quick, slow) == both
    assert better(None, quick) == quick
    too_high = with_bound(slow, plan.makespan_ms + 1, "e")
    assert better(too_high, quick) == quick
    with pytest.raises(InvalidPlanError, match="another situation"):
        better(slow, replace(quick, digest="0"))


def test_a_best_plan_with_a_wrong_makespan_is_refused() -> None:
    situation = one_room()
    best = with_plan(None, situation, greedy_plan(situation), "a")
    assert verified(best, situation) is best
    for wrong, message in (
        (replace(best, digest="0"), "another situation"),
        (replace(best, plan=best.plan[:-1]), "t1 has not been explored"),
        (replace(best, makespan_ms=best.makespan_ms - 1), "takes 19002 ms"),
        (replace(best, lower_bound_ms=best.makespan_ms + 1), "takes 19002 ms"),
    ):
        with pytest.raises(InvalidPlanError, match=message):
            verified(wrong, situation)


def test_an_invalid_file_of_best_plans_is_refused() -> None:
    with pytest.raises(InputError, match="no file of best plans"):
        read_best('{"suite": 1, "best": {"x": {"digest": "0"}}}')
    with pytest.raises(InputError, match="nested too deep"):
        read_best("[" * 100_000)
    with pytest.raises(InputError, match="are whole ms"):
        read_best(write_best({"x": replace(BEST["rooms-1x1-3"], makespan_ms=1.5)}))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="suite version 7"):
        read_best('{"suite": 7, "best": {}}')


def test_a_plan_that_waits_reads_back_with_its_waits() -> None:
    situation = one_room()
    waiting = Plan.of(
        [
            Action(name=ActionName.MOVE, start_ms=7, duration_ms=10_000, robot="c1", origin="c1_start", place="m1"),
            Action(name=ActionName.UNDOCK, start_ms=20_000, duration_ms=5_000, robot="r1", carrier="c1", place="m1"),
            Action(name=ActionName.EXPLORE, start_ms=30_000, duration_ms=4_000, robot="r1", origin="m1", place="t1"),
        ]
    )
    best: Best = with_plan(None, situation, waiting, "somebody")
    assert best.read_plan(situation) == waiting
