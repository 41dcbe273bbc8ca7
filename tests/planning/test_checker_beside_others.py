"""The checker beside two that know nothing of it: a simulation written here, and unified-planning's validator."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from situations import SOLVABLE, bring_them_home, one_room, situations
from up_problem import up_validate

from marsupial.model import Action, ActionName, Budget, Improved, Plan, PlanningType, Role, Situation, SituationGoal
from marsupial.planning.checker import ViolationKind, check
from marsupial.planning.list_scheduling.greedy import Greedy, serve


def with_action(actions: tuple[Action, ...], i: int, **changes: object) -> tuple[Action, ...]:
    return (*actions[:i], replace(actions[i], **changes), *actions[i + 1 :])


def solved(situation: Situation) -> list[Plan]:
    return [event.plan for event in Greedy().solve(situation, Budget(steps=3)) if isinstance(event, Improved)]


def mutations(situation: Situation, plan: Plan) -> Iterator[tuple[Action, ...]]:
    """Yield plans with one field of one action changed, or one action left out, that are all harmful.

    Later starts are left out, since waiting harms nobody unless it is for too long.
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
            assert not simulate(situation, mutant)


@pytest.mark.parametrize("name", SOLVABLE)
def test_unified_planning_accepts_what_the_checker_accepts(name: str) -> None:
    situation = SOLVABLE[name]()
    for plan in solved(situation):
        assert up_validate(situation, plan).valid


@settings(deadline=None)
@given(situations(), st.data())
def test_the_checker_agrees_with_a_simulation_on_changed_plans(situation: Situation, data: st.DataObject) -> None:
    plan, _ = serve(situation)
    targets = plan.explored
    assert check(situation, plan, targets=targets).valid == simulate(situation, plan, targets)
    if not plan.actions:
        return
    mutant = data.draw(mutants(situation, plan))
    assert check(situation, mutant, targets=targets).valid == simulate(situation, mutant, targets)


@settings(max_examples=60, deadline=None)
@given(situations(), st.data())
def test_the_checker_agrees_with_unified_planning(situation: Situation, data: st.DataObject) -> None:
    """But for actions with an origin or carrier too many, which PDDL leaves out."""
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


def test_the_simulation_has_a_mind_of_its_own() -> None:
    assert simulate(bring_them_home(), solved(bring_them_home())[0])
    out_there = SituationGoal(recover_rovers=True)
    assert not simulate(one_room(goal=out_there), solved(one_room())[0])


def simulate(situation: Situation, plan: Plan, targets: frozenset[str] | None = None) -> bool:
    """Carry a plan out moment by moment, as PDDL 2.1 would: conditions at start, over all and effects at both ends.

    Written apart from the checker: facts are a set of tuples, every moment at which something starts or ends is
    visited in turn, ends before starts; a dock takes its place at its start, an undock gives it back at its end.
    """
    facts: set[tuple[str, ...]] = set()
    room_left: dict[str, int] = {}
    kinds = {robot.name: situation.type_by_name[robot.type] for robot in situation.robots}
    for robot in situation.robots:
        facts.add(("at", robot.name, robot.place) if robot.place else ("on", robot.name, str(robot.carrier)))
        if kinds[robot.name].role is Role.CARRIER:
            room_left[robot.name] = kinds[robot.name].capacity - sum(r.carrier == robot.name for r in situation.robots)
    idle_since = {
        robot.name: situation.robot_by_name[robot.carrier].free_at_ms if robot.carrier else robot.free_at_ms
        for robot in situation.robots
    }
    running: set[str] = set()
    moments = sorted({a.start_ms for a in plan.actions} | {a.end_ms for a in plan.actions})
    if any(action.duration_ms < 1 for action in plan.actions) or any(moment < 0 for moment in moments):
        return False
    for now in moments:
        for action in (a for a in plan.actions if a.end_ms == now):
            if action.name is ActionName.DOCK:
                facts.add(("on", action.robot, str(action.carrier)))
            else:
                facts.add(("at", action.robot, action.place))
            if action.name is ActionName.UNDOCK and action.carrier in room_left:
                room_left[action.carrier] += 1
            if action.name is ActionName.EXPLORE:
                facts.add(("explored", action.place))
            for robot in action.robots:
                running.discard(robot)
                idle_since[robot] = now + 1
        for action in (a for a in plan.actions if a.start_ms == now):
            if any(robot in running or now < idle_since.get(robot, 0) for robot in action.robots):
                return False
            if not _startable(situation, kinds, facts, room_left, action):
                return False
            running.update(action.robots)
    wanted = {target.name for target in situation.targets} if targets is None else targets
    if any(("explored", target) not in facts for target in wanted):
        return False
    if situation.goal.recover_rovers or situation.goal.return_home:
        carried = {fact[1] for fact in facts if fact[0] == "on"}
        if {robot for robot, kind in kinds.items() if kind.role is Role.ROVER} - carried:
            return False
    homeward = [robot for robot in situation.robots if kinds[robot.name].role is Role.CARRIER and robot.home]
    return not situation.goal.return_home or all(("at", robot.name, robot.home) in facts for robot in homeward)


def _startable(
    situation: Situation,
    kinds: dict[str, PlanningType],
    facts: set[tuple[str, ...]],
    room_left: dict[str, int],
    action: Action,
) -> bool:
    """Say whether the conditions of an action hold, and take away what it takes at its start."""
    kind = kinds[action.robot]
    if action.name in (ActionName.MOVE, ActionName.EXPLORE):
        here = ("at", action.robot, str(action.origin))
        if here not in facts or action.carrier is not None or action.origin is None:
            return False
        goals = (
            situation.meetings + situation.homes
            if action.name is ActionName.MOVE
            else tuple(target.name for target in situation.targets if kind.name in target.explorers)
        )
        if action.place not in goals:
            return False
        cost = situation.travel(kind.name, action.origin, action.place)
        facts.discard(here)
        return cost is not None and action.duration_ms == max(cost, 1)
    meets = ("at", str(action.carrier), action.place) in facts and action.place in situation.meetings
    if not meets or action.carrier not in room_left or kind.role is not Role.ROVER or action.origin is not None:
        return False
    if action.name is ActionName.UNDOCK:
        aboard = ("on", action.robot, action.carrier)
        held = aboard in facts and action.duration_ms == max(kind.undock_ms, 1)
        facts.discard(aboard)
        return held
    there = ("at", action.robot, action.place)
    held = there in facts and action.duration_ms == max(kind.dock_ms, 1) and room_left[action.carrier] > 0
    facts.discard(there)
    room_left[action.carrier] -= 1
    return held
