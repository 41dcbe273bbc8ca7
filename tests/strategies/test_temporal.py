from collections.abc import Iterator, Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from support.planning.drawn_situations import situations
from support.planning.fake_engines import FakeEngine, WithPrices, brief, found, in_order
from support.planning.situations import one_hall, one_room, out_of_reach, two_rooms
from support.planning.spots import carrier, default_types, door, hall, room, rover, situation_of

from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model.objective import MAKESPAN, Objective, ObjectiveName
from marsupial.model.plan import ActionName, Plan
from marsupial.model.planning import Budget, Finished, Improved, Outcome
from marsupial.model.situation import Situation, SituationGoal
from marsupial.model.strategy import Briefing, Square, Unseen
from marsupial.planning.auto import auto
from marsupial.planning.checker import check
from marsupial.planning.greedy import Greedy, serve
from marsupial.planning.local_search.engine import Anytime
from marsupial.planning.schedule.timeline import Timeline
from marsupial.strategies.registry import asks_planner, strategy
from marsupial.strategies.temporal import MOST_REPEATS, Temporal, TemporalParts

BUDGET = Budget(steps=7)


class MissingEngine(FakeEngine):
    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        raise EngineUnavailable("fake is not installed")


def names(plan: Plan) -> list[str]:
    return [action.place for action in plan.actions]


def test_the_last_plan_of_the_engine_is_followed() -> None:
    situation = one_hall()
    bad, good = in_order(situation, "t2", "t1"), in_order(situation, "t1", "t2")
    decision = Temporal(FakeEngine(*found(bad, good)), BUDGET).decide(brief(situation))
    assert decision.plan == good
    report = decision.report
    assert (report.planner, report.outcome, report.refused) == ("fake", Outcome.SATISFICING, 0)
    assert report.first_plan_s == 1.0
    assert report.detail == ""


def test_the_budget_and_the_situation_are_passed_on_as_they_are() -> None:
    engine, situation = FakeEngine(*found()), one_hall()
    Temporal(engine, BUDGET).decide(brief(situation))
    assert engine.asked == [(situation, BUDGET, in_order(situation, "t1", "t2"))]
    assert engine.asked[0][1] is BUDGET


def test_priced_arrival_is_asked_of_engines_that_can_take_it_and_the_makespan_of_others() -> None:
    for engine, expected in ((WithPrices(), ObjectiveName.PRICED_ARRIVAL), (FakeEngine(), ObjectiveName.MAKESPAN)):
        Temporal(engine, BUDGET).decide(brief(one_hall()))
        assert engine.objectives == [expected]


def test_recovery_is_asked_for_by_makespan_of_every_engine() -> None:
    situation = one_room(goal=SituationGoal(recover_rovers=True))
    situation = replace(situation, targets=(), travel_ms=situation.restricted(targets=frozenset()).travel_ms)
    engine = WithPrices()
    Temporal(engine, BUDGET).decide(brief(situation))
    assert engine.objectives == [ObjectiveName.MAKESPAN]


def test_of_an_engines_plans_the_best_by_what_it_was_asked_for_counts() -> None:
    situation = one_hall()
    bad, good = in_order(situation, "t2", "t1"), in_order(situation, "t1", "t2")
    for engine in (FakeEngine(*found(good, bad)), WithPrices(*found(good, bad))):
        assert Temporal(engine, BUDGET).decide(brief(situation)).plan == good


def test_plans_that_the_checker_refuses_are_not_followed() -> None:
    situation = one_hall()
    good = in_order(situation, "t1", "t2")
    broken = Plan(actions=(replace(good.actions[0], duration_ms=1),))
    decision = Temporal(FakeEngine(*found(good, broken)), BUDGET).decide(brief(situation))
    assert decision.plan == good
    assert decision.report.refused == 1


def test_if_all_are_refused_the_greedy_plan_is_followed() -> None:
    situation = two_rooms()
    plan, _ = serve(replace(situation, goal=SituationGoal(recover_rovers=True)))
    broken = Plan(actions=plan.actions[1:])
    decision = Temporal(FakeEngine(*found(broken, broken)), BUDGET).decide(brief(situation))
    assert decision.plan == plan
    assert (decision.report.refused, decision.report.first_plan_s) == (2, None)


@pytest.mark.parametrize("outcome", [Outcome.TIMEOUT, Outcome.CRASHED, Outcome.KILLED, Outcome.UNSUPPORTED])
def test_the_fallback_replaces_a_missing_answer_and_it_is_reported(outcome: Outcome) -> None:
    engine = FakeEngine(Finished(outcome=outcome, detail="so it is"))
    decision = Temporal(engine, BUDGET).decide(brief(one_hall()))
    assert names(decision.plan) == ["t1", "t2"]
    assert decision.report.outcome is outcome
    assert decision.report.detail == f"fake: {outcome} (so it is)"


@pytest.mark.parametrize("plans", [None, (Plan(actions=()),)], ids=["nothing at all", "nothing to do"])
def test_the_fallback_replaces_an_empty_plan_of_the_engine(plans: tuple[Plan] | None) -> None:
    decision = Temporal(FakeEngine(*(() if plans is None else found(*plans))), BUDGET).decide(brief(one_hall()))
    assert names(decision.plan) == ["t1", "t2"]
    assert (decision.report.outcome is Outcome.NO_PLAN) == (plans is None)


def test_a_rover_that_no_carrier_can_retrieve_hinders_no_plan() -> None:
    targets, starts = {"t1": hall(10), "t2": hall(20)}, {"c1_start": hall(0), "r1_start": room(5)}
    situation = situation_of([carrier(), rover()], targets, {}, starts)
    engine = WithPrices(*found(in_order(situation, "t1", "t2")))
    assert Temporal(engine, BUDGET).decide(brief(situation)).plan == in_order(situation, "t1", "t2")
    assert engine.asked[0][0] == situation


def test_a_missing_engine_does_not_use_the_fallback() -> None:
    with pytest.raises(EngineUnavailable):
        Temporal(MissingEngine(), BUDGET).decide(brief(one_hall()))


def test_targets_that_no_robot_can_serve_are_named_and_the_others_explored() -> None:
    engine = FakeEngine(Finished(outcome=Outcome.UNSOLVABLE, detail="no way to t2"))
    decision = Temporal(engine, BUDGET).decide(brief(out_of_reach()))
    assert names(decision.plan) == ["t1"]
    assert decision.report.detail == "fake: unsolvable (no way to t2); nobody can serve t2"


def equals() -> tuple[Situation, Plan, Plan]:
    """Return a carrier between two targets equally far, and both orders to explore them."""
    situation = situation_of([carrier()], {"t1": hall(-10), "t2": hall(10)}, {}, {"c1_start": hall(0)})
    return situation, in_order(situation, "t1", "t2"), in_order(situation, "t2", "t1")


def test_a_plan_for_a_part_of_the_targets_may_be_followed() -> None:
    situation, _, other = equals()
    part = Plan(actions=other.actions[:1])
    assert Temporal(FakeEngine(*found(part)), BUDGET).decide(brief(situation)).plan.actions[0] == part.actions[0]


def test_between_equals_the_previous_plan_is_kept() -> None:
    situation, one, other = equals()
    assert Temporal(FakeEngine(*found(other)), BUDGET).decide(brief(situation, one)).plan == one
    assert Temporal(FakeEngine(*found(one)), BUDGET).decide(brief(situation, other)).plan == other


@pytest.mark.parametrize("previous", [("t2", "t1"), ("t1",)], ids=["slower", "without a target"])
def test_a_better_plan_replaces_the_previous_one(previous: tuple[str, ...]) -> None:
    situation = one_hall()
    better = in_order(situation, "t1", "t2")
    decision = Temporal(FakeEngine(*found(better)), BUDGET).decide(brief(situation, in_order(situation, *previous)))
    assert decision.plan == better


def test_the_previous_plan_is_the_first_candidate() -> None:
    situation = one_hall()
    whole = in_order(situation, "t1", "t2")
    engine = FakeEngine(*found())
    Temporal(engine, BUDGET).decide(brief(situation, whole))
    assert [start for _, _, start in engine.asked] == [whole]


def heading(situation: Situation, target: str, previous: Plan | None = None) -> Briefing:
    """Return a briefing after which the deployment heuristic sends the carrier to this target, and nowhere else."""
    return replace(brief(situation, previous), direct_ms=lambda: {"c1": {target: 1}})


def test_without_a_previous_plan_the_best_plan_of_the_rules_is_the_first_candidate() -> None:
    situation = one_hall()
    engine = FakeEngine(*found())
    # the heuristic would explore the farther target first, the assignment goes to the nearer one
    Temporal(engine, BUDGET).decide(heading(situation, "t2"))
    assert [start for _, _, start in engine.asked] == [in_order(situation, "t1", "t2")]


def test_the_better_of_the_previous_plan_and_the_heuristics_is_the_first_candidate() -> None:
    situation = one_hall()
    slow, fast = in_order(situation, "t2", "t1"), in_order(situation, "t1", "t2")
    engine = FakeEngine(*found())
    Temporal(engine, BUDGET).decide(heading(situation, "t1", slow))
    Temporal(engine, BUDGET).decide(heading(situation, "t2", fast))
    assert [start for _, _, start in engine.asked] == [fast, fast]


def test_of_a_previous_plan_and_the_heuristics_as_good_the_previous_one_is_kept() -> None:
    situation, one, other = equals()
    engine = FakeEngine(*found())
    for previous, target in ((one, "t2"), (other, "t1")):
        assert Temporal(engine, BUDGET).decide(heading(situation, target, previous)).plan == previous
    assert [start for _, _, start in engine.asked] == [one, other]


def test_the_heuristics_plan_is_followed_where_the_greedy_one_is_no_better() -> None:
    situation, one, other = equals()
    assert serve(situation)[0] == one
    silent = FakeEngine(Finished(outcome=Outcome.TIMEOUT))
    assert Temporal(silent, BUDGET).decide(heading(situation, "t2")).plan == other


def test_without_an_answer_the_previous_plan_is_kept_where_greedy_has_none_better() -> None:
    situation, _, other = equals()
    silent = FakeEngine(Finished(outcome=Outcome.TIMEOUT))
    assert Temporal(silent, BUDGET).decide(brief(situation, other)).plan == other
    slow, fast = in_order(one_hall(), "t2", "t1"), in_order(one_hall(), "t1", "t2")
    assert Temporal(silent, BUDGET).decide(brief(one_hall(), slow)).plan == fast


def decided(situation: Situation, *plans: Plan, previous: Plan | None = None) -> Plan:
    return Temporal(WithPrices(*found(*plans)), BUDGET).decide(brief(situation, previous)).plan


def test_actions_that_many_targets_wait_for_come_first_although_the_plan_takes_longer() -> None:
    three = {"t1": hall(10), "t2": hall(12), "t3": hall(14), "far": hall(-9)}
    situation = situation_of([carrier()], three, {}, {"c1_start": hall(0)})
    long, short = in_order(situation, "t1", "t2", "t3", "far"), in_order(situation, "far", "t1", "t2", "t3")
    assert long.makespan_ms > short.makespan_ms
    assert decided(situation, short, long, previous=short) == long
    assert decided(situation, short, previous=long) == long


def test_robots_keep_their_path_for_a_slightly_better_plan() -> None:
    def left(seconds: int) -> str:
        targets = {"left": hall(-seconds), "right": hall(20)}
        situation = situation_of([carrier()], targets, {}, {"c1_start": hall(0)})
        on_its_way = in_order(situation, "right", "left")
        return decided(situation, in_order(situation, "left", "right"), previous=on_its_way).actions[0].place

    assert left(seconds=19) == "right"
    assert left(seconds=15) == "left"


def doors(apart_s: int) -> tuple[Situation, Plan, Plan]:
    """Return two targets behind one door, and plans for them by one rover and by two."""
    team, targets = [carrier(), rover(1, on="c1"), rover(2, on="c1")], {"t1": room(10), "t2": room(10 + apart_s)}
    situation = situation_of(team, targets, {"m1": door(10)}, {"c1_start": hall(0)}, types=default_types(capacity=2))
    alone, together = Timeline.of(situation), Timeline.of(situation)
    alone.undock("r1", "m1")
    alone.explore("r1", "t1")
    alone.explore("r1", "t2")
    together.undock("r1", "m1")
    together.undock("r2", "m1")
    together.explore("r1", "t1")
    together.explore("r2", "t2")
    return situation, alone.plan, together.plan


def test_a_second_rover_is_not_set_down_for_what_the_first_can_do_soon() -> None:
    situation, alone, together = doors(apart_s=8)
    for one, other in ((alone, together), (together, alone)):
        plan = decided(situation, one, previous=other)
        assert plan.actions[: len(alone.actions)] == alone.actions
        assert [action.name for action in plan.actions[len(alone.actions) :]] == [ActionName.MOVE, ActionName.DOCK]


def between_squares() -> Briefing:
    """Return a briefing in which a guess keeps two carriers apart that know of two targets."""
    targets, starts = {"t1": hall(10), "t2": hall(-3)}, {"c1_start": hall(9), "c2_start": hall(0)}
    situation = situation_of([carrier(1), carrier(2)], targets, {}, starts)
    squares = tuple(Square(name=f"{y}", x_m=10.0, y_m=y, share=1.0, draw=0.9) for y in (-25.0, 25.0))
    unseen = Unseen(squares=squares, at_m={"t1": (10.0, 0.0)}, speed_mps={"carrier": 1.0})
    return replace(brief(situation), unseen=lambda: unseen)


def test_no_guess_is_made_for_targets_that_are_the_same_again_and_again() -> None:
    briefing, engine = between_squares(), WithPrices()
    strategy = Temporal(engine, BUDGET)
    for _ in range(MOST_REPEATS + 1):
        strategy.decide(briefing)
    guessed = [len(situation.targets) > 2 for situation, *_ in engine.asked]
    assert guessed == [True] * MOST_REPEATS + [False]


def test_engines_that_can_be_given_an_aim_plan_for_the_guess_and_robots_do_what_is_real_of_it() -> None:
    briefing = between_squares()
    for engine in (Anytime(), auto()):
        plan = Temporal(engine, Budget(steps=2)).decide(briefing).plan
        assert [(a.robot, a.place) for a in plan.actions if a.robot == "c1"] == [("c1", "t1")]
        # without the guess the second carrier would stay where it has explored its target
        assert [(a.robot, a.place) for a in plan.actions if a.robot == "c2"] == [("c2", "t2"), ("c2", "t1")]
        assert Temporal(engine, Budget(steps=2)).decide(briefing).plan == plan


def test_without_the_guess_the_known_targets_alone_are_asked_of_the_engine() -> None:
    briefing = between_squares()
    for guess, targets in ((1.0, 4), (0.0, 2)):
        engine = WithPrices(*found())
        Temporal(engine, BUDGET, TemporalParts(guess=guess)).decide(briefing)
        assert len(engine.asked[0][0].targets) == targets
        assert engine.objectives == [ObjectiveName.PRICED_ARRIVAL]


def test_without_prices_the_shortest_plan_for_the_guess_is_asked_of_the_engine() -> None:
    engine = WithPrices(*found())
    Temporal(engine, BUDGET, TemporalParts(price=0.0)).decide(between_squares())
    assert len(engine.asked[0][0].targets) == 4
    assert engine.objectives == [ObjectiveName.MAKESPAN]


def test_without_the_choice_only_the_previous_plan_is_weighed_against_the_planners() -> None:
    situation, one, other = equals()
    slow = in_order(one_hall(), "t2", "t1")
    silent = FakeEngine(Finished(outcome=Outcome.TIMEOUT))
    alone = Temporal(silent, BUDGET, TemporalParts(choice=0.0))
    assert alone.decide(heading(situation, "t1", other)).plan == other
    assert alone.decide(brief(one_hall(), slow)).plan == slow
    assert alone.decide(brief(situation)).plan == one


def test_a_part_is_left_out_by_the_name_of_the_strategy() -> None:
    made = strategy("temporal/guess=0", planner="greedy", budget=BUDGET)
    assert made.name == "temporal/guess=0"
    assert asks_planner(made.name)
    with pytest.raises(
        UsageError, match="strategy temporal: takes the parameters guess, price, early, choice, once each"
    ):
        strategy("temporal/gues=0", planner="greedy", budget=BUDGET)


def test_an_engine_that_can_be_given_an_aim_is_asked_only_about_what_can_be_served() -> None:
    decision = Temporal(Anytime(), Budget(steps=1)).decide(brief(out_of_reach()))
    assert names(decision.plan) == ["t1"]
    assert decision.report.detail == "; nobody can serve t2"


def test_with_nothing_to_do_no_engine_is_asked() -> None:
    engine = FakeEngine(*found())
    situation = situation_of([carrier(), rover()], {}, {}, {"c1_start": hall(0), "r1_start": room(3)})
    assert Temporal(engine, BUDGET).decide(brief(situation)).plan.actions == ()
    assert engine.asked == []


@pytest.mark.parametrize("wish", [SituationGoal(recover_rovers=True), SituationGoal(return_home=True)])
def test_recovery_and_return_are_asked_of_the_engine(wish: SituationGoal) -> None:
    engine = FakeEngine(*found())
    situation = replace(one_room(goal=wish), targets=(), travel_ms=one_room().restricted(targets=frozenset()).travel_ms)
    Temporal(engine, BUDGET).decide(brief(situation))
    assert len(engine.asked) == 1


def _plans(situation: Situation) -> Sequence[Plan | None]:
    plan, _ = serve(situation)
    return (None, plan) if plan.actions else (None,)


@given(situations())
def test_all_its_plans_are_accepted_by_the_checker(situation: Situation) -> None:
    for previous in _plans(situation):
        for engine in (Greedy(), FakeEngine(), FakeEngine(Finished(outcome=Outcome.TIMEOUT))):
            plan = Temporal(engine, Budget(steps=1)).decide(brief(situation, previous)).plan
            physical = replace(situation, goal=SituationGoal())
            verdict = check(physical, plan, targets=plan.explored)
            assert verdict.valid, verdict.violation
