from support.planning.fake_engines import FakeEngine, brief, found, in_order
from support.planning.situations import one_hall

from marsupial.model import Budget
from marsupial.model.plan import Plan
from marsupial.strategies.reasons import Candidate, reasons
from marsupial.strategies.temporal import Temporal, TemporalParts

SITUATION = one_hall()
NEAR, FAR = in_order(SITUATION, "t1", "t2"), in_order(SITUATION, "t2", "t1")


def candidate(maker: str, plan: Plan, price: float) -> Candidate:
    return Candidate(maker=maker, plan=plan, left_out=0, value=(price,))


def test_plans_that_begin_alike_count_as_one_and_the_next_best_says_where_robots_would_go() -> None:
    candidates = [candidate("a", NEAR, 20_000.0), candidate("b", NEAR, 21_000.0), candidate("c", FAR, 30_000.0)]
    why = reasons(candidates, 2.0, None, lambda plan: plan.actions)
    assert why.compared == (("a", 10_000, 0), ("c", 15_000, 0))
    assert why.instead == (("c1", ("t2", "t1")),)


def test_a_plan_without_another_has_nothing_to_do_instead() -> None:
    why = reasons([candidate("a", NEAR, 1.0)], 1.0, None, lambda plan: plan.actions)
    assert (why.compared, why.instead) == ((("a", 1, 0),), ())


def test_the_strategy_names_whose_plans_it_compared() -> None:
    parts = TemporalParts(guess=0, price=0)
    decision = Temporal(FakeEngine(*found(NEAR)), Budget(steps=1), parts).decide(brief(SITUATION, previous=FAR))
    assert [maker for maker, _, _ in decision.reasons.compared] == ["fake", "previous"]
    assert decision.reasons.compared[0][1] < decision.reasons.compared[1][1]
    assert decision.reasons.instead == (("c1", ("t2", "t1")),)
