from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
from hypothesis import given
from support.planning.drawn_situations import situations
from support.planning.situations import bring_them_home, in_flight, many_rooms, one_room, out_of_reach, relay
from support.planning.spots import carrier, door, hall, room, rover, situation_of
from support.waiting import HANG_S

from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Engine, EngineInfo, Finished, Improved, Outcome
from marsupial.model.robots import Role
from marsupial.model.situation import Situation, SituationGoal
from marsupial.planning.checker import check
from marsupial.planning.external.decompose import PartSize, decompose
from marsupial.planning.external.decomposed import Decomposed
from marsupial.planning.greedy import Greedy

SMALL = PartSize(rovers=2, targets=2)
ONE_CARRIER_ONE_TARGET = PartSize(rovers=1, targets=1)
ASK_ALL = SituationGoal(recover_rovers=True, return_home=True)


def names(part: Situation) -> set[str]:
    return {robot.name for robot in part.robots}


def targets(part: Situation) -> set[str]:
    return {target.name for target in part.targets}


def two_halls(*, goal: SituationGoal | None = None) -> Situation:
    """Return: two carriers 100 s apart, a rover aboard each, a door and a room target near each, one hall target."""
    return situation_of(
        [carrier(1, home="h1"), rover(1, "c1"), carrier(2, home="h2"), rover(2, "c2")],
        {"t1": room(12, 1), "t2": room(92, 2), "t3": hall(5)},
        {"m1": door(10, 1), "m2": door(90, 2)},
        {"c1_start": hall(0), "c2_start": hall(100)},
        homes={"h1": hall(0), "h2": hall(100)},
        goal=goal,
    )


def test_a_situation_that_fits_is_its_own_part() -> None:
    assert decompose(one_room(), SMALL) == (one_room(),)


def test_every_target_goes_to_the_carrier_that_serves_it_soonest() -> None:
    first, second = decompose(two_halls(), SMALL)
    assert (names(first), targets(first), first.meetings) == ({"c1", "r1"}, {"t1", "t3"}, ("m1",))
    assert (names(second), targets(second)) == ({"c2", "r2"}, {"t2"})


def test_only_the_best_meetings_are_kept() -> None:
    situation = situation_of(
        [carrier(1), rover(1, "c1"), carrier(2)],
        {"t1": room(20)},
        {"m1": door(10), "m2": door(19), "m3": door(-5), "m4": door(12)},
        {"c1_start": hall(0), "c2_start": hall(50)},
    )
    (one,) = decompose(situation, PartSize(rovers=1, targets=1, choices=1))
    (two,) = decompose(situation, PartSize(rovers=1, targets=1, choices=2))
    assert one.meetings == ("m2",)  # 19 s + 2 s: rovers have half the speed
    assert two.meetings == ("m2", "m4")


def test_targets_above_the_limit_are_left_for_later() -> None:
    parts = decompose(two_halls(), ONE_CARRIER_ONE_TARGET)
    assert [targets(part) for part in parts] == [{"t3"}, {"t2"}]


def test_a_rover_on_the_ground_drives_on_by_itself() -> None:
    parts = decompose(in_flight(), ONE_CARRIER_ONE_TARGET)
    alone = next(part for part in parts if names(part) == {"r2"})
    assert (targets(alone), alone.meetings) == ({"t2"}, ())


def test_a_rover_with_nothing_in_reach_joins_the_carrier_that_can_fetch_it() -> None:
    situation = situation_of(
        [carrier(1), carrier(2), rover()],
        {"t1": room(22, 2), "t2": hall(50)},
        {"m1": door(-10, 1), "m2": door(20, 2)},
        {"c1_start": hall(0), "c2_start": hall(60), "r1_start": room(-11, 1)},
    )
    parts = decompose(situation, SMALL)
    fetching = next(part for part in parts if "r1" in names(part))
    assert (names(fetching), targets(fetching)) == ({"c1", "r1"}, {"t1"})
    assert set(fetching.meetings) == {"m1", "m2"}


def test_a_rover_is_fetched_by_a_carrier_that_has_a_place_left() -> None:
    situation = situation_of(
        [carrier(1), rover(1, "c1"), carrier(2), rover(2)],
        {},
        {"m1": door(10), "m2": door(20)},
        {"c1_start": hall(0), "c2_start": hall(100), "r2_start": room(5)},
        goal=SituationGoal(recover_rovers=True),
    )
    assert [names(part) for part in decompose(situation, ONE_CARRIER_ONE_TARGET)] == [{"c1", "r1"}, {"c2", "r2"}]


def test_with_no_targets_left_rovers_go_to_carriers_with_room_for_them() -> None:
    parts = decompose(bring_them_home(), ONE_CARRIER_ONE_TARGET)
    assert sorted(sorted(names(part)) for part in parts) == [["c1", "r1"], ["c2", "r2"]]
    assert all(part.goal == bring_them_home().goal for part in parts)


def test_where_the_goal_asks_for_more_idle_carriers_have_parts_too() -> None:
    situation = two_halls(goal=ASK_ALL)
    parts = decompose(situation.restricted(targets=frozenset({"t1"})), ONE_CARRIER_ONE_TARGET)
    assert [targets(part) for part in parts] == [{"t1"}, set()]


def test_a_target_out_of_everybodys_reach_is_in_no_part() -> None:
    parts = decompose(out_of_reach(), PartSize(rovers=0, targets=1))
    assert [targets(part) for part in parts] == [{"t1"}]


def serve(situation: Situation) -> Plan:
    event, *_ = Greedy().solve(situation, Budget(steps=1))
    return event.plan


@given(situations())
def test_parts_have_disjoint_robots_and_targets_and_keep_the_limit(situation: Situation) -> None:
    limit = PartSize(rovers=1, targets=2)
    parts = decompose(situation, limit)
    if parts == (situation,):
        return
    robots = [name for part in parts for name in names(part)]
    shared = [name for part in parts for name in targets(part)]
    assert len(robots) == len(set(robots))
    assert len(shared) == len(set(shared))
    for part in parts:
        assert len(part.of_role(Role.CARRIER)) <= 1
        assert len(part.targets) <= 2
        assert len(part.of_role(Role.ROVER)) <= 1 or part.goal.recover_rovers or part.goal.return_home


@given(situations(goals=False))
def test_plans_of_parts_are_valid_together(situation: Situation) -> None:
    engine = Decomposed(Greedy(), PartSize(rovers=1, targets=2))
    *plans, end = engine.solve(situation, Budget(seconds=5))
    assert isinstance(end, Finished)
    for event in plans:
        assert check(situation, event.plan, targets=event.plan.explored).valid


class Fake:
    """An engine with a script for each part, keyed by the part's first carrier or rover."""

    info = EngineInfo(name="fake", anytime=True, proves_optimality=True)

    def __init__(self, script: dict[str, str]) -> None:
        self.script = script
        self.asked: list[Budget] = []
        self.cancelled = threading.Event()

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self.asked.append(budget)
        return Scripted(self, self.script[situation.robots[0].name], situation)


class Scripted:
    def __init__(self, engine: Fake, word: str, situation: Situation) -> None:
        self.engine = engine
        self.steps = {"plan": self.plan, "fail": self.fail, "hang": self.hang, "break": self.break_down}[word](
            situation
        )

    def __iter__(self) -> Scripted:
        return self

    def __next__(self) -> Improved | Finished:
        return next(self.steps)

    def cancel(self) -> None:
        self.engine.cancelled.set()

    def plan(self, situation: Situation) -> Iterator[Improved | Finished]:
        yield Improved(plan=serve(situation), elapsed_s=0.0)
        yield Finished(outcome=Outcome.OPTIMAL)

    def fail(self, situation: Situation) -> Iterator[Improved | Finished]:
        yield Finished(outcome=Outcome.CRASHED, detail="fell over")

    def hang(self, situation: Situation) -> Iterator[Improved | Finished]:
        yield Improved(plan=serve(situation), elapsed_s=0.0)
        assert self.engine.cancelled.wait(HANG_S)

    def break_down(self, situation: Situation) -> Iterator[Improved | Finished]:
        raise RuntimeError("a bug")
        yield


def solve(engine: Engine, situation: Situation, seconds: float = HANG_S) -> list[Improved | Finished]:
    return list(Decomposed(engine, SMALL).solve(situation, Budget(seconds=seconds)))


def test_all_parts_together_make_the_plan_and_nothing_is_proven() -> None:
    *improved, end = solve(Fake({"c1": "plan", "c2": "plan"}), two_halls())
    assert isinstance(improved[-1], Improved)
    assert improved[-1].plan.explored == {"t1", "t2", "t3"}
    assert end.outcome is Outcome.SATISFICING
    assert end.detail == "2 of 2 parts planned, 3 targets in them"


def test_if_a_part_fails_the_others_still_count() -> None:
    improved, end = solve(Fake({"c1": "fail", "c2": "plan"}), two_halls())
    assert improved.plan.explored == {"t2"}
    assert end.outcome is Outcome.SATISFICING
    assert end.detail.endswith("part 1: crashed")


def test_if_all_parts_fail_the_outcome_is_that_of_the_first() -> None:
    (end,) = solve(Fake({"c1": "fail", "c2": "fail"}), two_halls())
    assert end.outcome is Outcome.CRASHED
    assert "fell over" in end.detail


def test_no_plan_is_passed_on_before_all_parts_reach_the_goal_asked_for() -> None:
    (end,) = solve(Fake({"c1": "fail", "c2": "plan"}), two_halls(goal=SituationGoal(return_home=True)))
    assert isinstance(end, Finished)
    *improved, _ = solve(Fake({"c1": "plan", "c2": "plan"}), two_halls(goal=SituationGoal(return_home=True)))
    assert len(improved) == 1


def test_a_bug_in_the_engine_is_not_swallowed() -> None:
    with pytest.raises(RuntimeError, match="a bug"):
        solve(Fake({"c1": "plan", "c2": "break"}), two_halls())


def test_closing_early_cancels_what_is_running() -> None:
    engine = Fake({"c1": "hang", "c2": "hang"})
    events = Decomposed(engine, SMALL).solve(two_halls(), Budget(seconds=HANG_S))
    next(events)
    events.close()  # type: ignore[attr-defined]
    assert engine.cancelled.is_set()


def test_the_budget_is_shared_by_the_rounds_of_parts() -> None:
    engine = Fake({f"c{i}": "plan" for i in range(6)})
    list(Decomposed(engine, SMALL).solve(many_rooms(6, 2, 12, 6), Budget(seconds=HANG_S)))
    assert len(engine.asked) == 6
    first, *later = [budget.seconds or 0.0 for budget in engine.asked]
    assert HANG_S / 4 < first <= HANG_S / 3 < max(later) <= HANG_S


def test_parts_get_at_least_what_the_smallest_size_needs_and_the_last_ones_nothing() -> None:
    class Slow(Fake):
        def solve(
            self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
        ) -> Iterator[Improved | Finished]:
            assert budget.seconds is not None
            time.sleep(budget.seconds)
            return super().solve(situation, budget, start=start)

    engine = Slow({f"c{i}": "plan" for i in range(6)})
    limit = PartSize(rovers=2, targets=2, seconds=0.3)
    *_, end = Decomposed(engine, limit).solve(many_rooms(6, 2, 12, 6), Budget(seconds=0.3))
    assert end.detail.startswith("2 of 6 parts planned")


def test_larger_parts_are_solved_if_time_permits() -> None:
    sizes = (PartSize(rovers=2, targets=3, seconds=5.0), PartSize(rovers=2, targets=1))
    explored = []
    for seconds in (20.0, 1.0):
        engine = Fake({"c0": "plan", "c1": "plan"})
        *_, last, _end = Decomposed(engine, *sizes).solve(many_rooms(2, 2, 8, 4), Budget(seconds=seconds))
        explored.append(len(last.plan.explored))
    assert explored == [6, 2]


def test_a_small_situation_is_solved_as_a_whole() -> None:
    engine = Fake({"c1": "plan"})
    _, end = Decomposed(engine, SMALL).solve(one_room(), Budget(seconds=7))
    assert end.outcome is Outcome.OPTIMAL
    assert engine.asked == [Budget(seconds=7)]


def test_a_target_that_needs_several_carriers_is_in_no_part() -> None:
    (end,) = solve(Fake({}), relay())
    assert end.outcome is Outcome.NO_PLAN
