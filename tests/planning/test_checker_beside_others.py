"""The checker against an independent one: unified-planning's validator."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.planning.drawn_situations import situations
from support.planning.situations import SOLVABLE
from support.planning.up_problem import up_validate

from marsupial.model import Action, ActionName, Budget, Improved, Plan, Role, Situation
from marsupial.planning.checker import ViolationKind, check
from marsupial.planning.greedy import Greedy, serve


def with_action(actions: tuple[Action, ...], i: int, **changes: object) -> tuple[Action, ...]:
    return (*actions[:i], replace(actions[i], **changes), *actions[i + 1 :])


def solved(situation: Situation) -> list[Plan]:
    return [event.plan for event in Greedy().solve(situation, Budget(steps=3)) if isinstance(event, Improved)]


def mutations(situation: Situation, plan: Plan) -> Iterator[tuple[Action, ...]]:
    """Yield plans with one field of one action changed, or one action left out, that are all harmful.

    Later starts are left out, since waiting is harmless unless it is too long.
    """
    for i, action in enumerate(plan.actions):
        for change in (-1, 1, 1000):
            yield with_action(plan.actions, i, duration_ms=action.duration_ms + change)
        yield plan.actions[:i] + plan.actions[i + 1 :]
        for other in situation.robots:
            if other.name not in action.robots:
                yield with_action(plan.actions, i, robot=other.name)
        for place in situation.places:
            if action.origin is not None and place != action.origin:
                yield with_action(plan.actions, i, origin=place)
            if place != action.place:
                yield with_action(plan.actions, i, place=place)
        for name in ActionName:
            if name is not action.name:
                yield with_action(plan.actions, i, name=name)
        if action.start_ms > 0:
            yield with_action(plan.actions, i, start_ms=-action.start_ms)
        if any(set(action.robots) & set(before.robots) for before in plan.actions[:i]):
            yield with_action(plan.actions, i, start_ms=action.start_ms - 1)


@pytest.mark.parametrize("name", SOLVABLE)
def test_every_harmful_mutation_of_a_tight_plan_is_refused(name: str) -> None:
    situation = SOLVABLE[name]()
    for plan in solved(situation):
        assert check(situation, plan).valid
        for actions in mutations(situation, plan):
            mutant = Plan.of(actions)
            assert not check(situation, mutant).valid, [str(action) for action in mutant.actions]


@pytest.mark.parametrize("name", SOLVABLE)
def test_unified_planning_accepts_what_the_checker_accepts(name: str) -> None:
    situation = SOLVABLE[name]()
    for plan in solved(situation):
        assert up_validate(situation, plan).valid


@settings(max_examples=25)
@given(situations(), st.data())
def test_the_checker_agrees_with_unified_planning(situation: Situation, data: st.DataObject) -> None:
    """Except for superfluous origins and carriers of actions, which PDDL omits."""
    plan, unserved = serve(situation)
    served = frozenset(target.name for target in situation.targets) - unserved
    situation = situation.restricted(targets=served)
    assert check(situation, plan).valid == up_validate(situation, plan).valid
    if plan.actions:
        mutant = data.draw(mutants(situation, plan))
        found = check(situation, mutant)
        if found.violation is None or found.violation.kind is not ViolationKind.MALFORMED:
            assert found.valid == up_validate(situation, mutant).valid, found.violation


@st.composite
def mutants(draw: st.DrawFn, situation: Situation, plan: Plan) -> Plan:
    """Draw the plan with one field of one action changed, harmful or not."""
    i = draw(st.integers(0, len(plan.actions) - 1))
    field = draw(st.sampled_from(["start_ms", "duration_ms", "robot", "place", "origin", "carrier", "name"]))
    values = {
        "start_ms": st.integers(-1, 40),
        "duration_ms": st.integers(0, 20),
        "robot": st.sampled_from([robot.name for robot in situation.robots]),
        "place": st.sampled_from(situation.places),
        "origin": st.sampled_from([None, *situation.places]),
        "carrier": st.sampled_from([None, *(robot.name for robot in situation.of_role(Role.CARRIER))]),
        "name": st.sampled_from(ActionName),
    }
    return Plan.of(with_action(plan.actions, i, **{field: draw(values[field])}))
