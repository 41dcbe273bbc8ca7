"""Engines that solve the domain with batteries: Tamer on the problem as PDDL, and planners by their command lines."""

import shlex
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.planning.charged_teams import ROVER, charged
from support.planning.situations import two_rooms
from support.planning.up_problem import from_up_plan, up_problem
from support.waiting import HANG_S, doubling_budgets

from marsupial.formats.pddl.domain import PLAIN, WITH_BATTERIES
from marsupial.model import Budget, Finished, Improved, Outcome, Plan, Situation, SituationGoal
from marsupial.planning.batteries.engine import BatteryEngine
from marsupial.planning.checker import ViolationKind, check
from marsupial.planning.engines import engine
from marsupial.planning.external.commands import External

COMMANDS = {
    "lpg": "cmd:lpg -o {domain} -f {problem_batteries} -n 20 -seed 1 -out {plan}",
    "kairos": "cmd:kairos {domain} {problem_batteries}",
}


def tight() -> Situation:
    """Return two rooms for a rover whose battery lasts for one of them."""
    situation = replace(two_rooms(), goal=SituationGoal(recover_rovers=True))
    return charged(situation, {"rover": replace(ROVER, capacity_j=170.0, charge_w=2.0)})


def test_tamer_lets_the_rover_charge_only_where_it_knows_of_batteries() -> None:
    pytest.importorskip("up_tamer")
    situation = tight()
    hasty, patient = tamer_plan(situation.without_batteries()), tamer_plan(situation)
    violation = check(situation, hasty).violation
    assert violation is not None
    assert violation.kind is ViolationKind.BATTERY_EMPTY
    assert check(situation, patient).valid


def tamer_plan(situation: Situation) -> Plan:
    """Return Tamer's plan for the problem as our PDDL says it.

    Tamer knows neither subtypes nor a metric: actions are written out, and each fact becomes a fluent of its own.
    """
    import unified_planning.shortcuts as up
    from unified_planning.engines import CompilationKind
    from unified_planning.plans import ActionInstance
    from up_tamer.engine import EngineImpl

    problem = up_problem(situation, records=False)
    problem.clear_quality_metrics()
    for fluent in problem.fluents:
        if fluent.type.is_real_type():
            problem._fluents_defaults[fluent] = up.Int(0)
    with up.Compiler(name="up_grounder") as grounder:
        grounded = grounder.compile(problem, CompilationKind.GROUNDING)
    flat, names = up.Problem("flat"), {}
    for i, (fact, value) in enumerate(grounded.problem.initial_values.items()):
        kind = up.RealType() if fact.fluent().type.is_real_type() else up.BoolType()
        names[fact] = flat.add_fluent(up.Fluent(f"f{i}", kind), default_initial_value=value)()
    originals = {action.name: action for action in grounded.problem.actions}
    flat.add_actions(_renamed(action, names) for action in originals.values())
    for goal in grounded.problem.goals:
        flat.add_goal(goal.substitute(names))
    plan = EngineImpl(weight=0.8).solve(flat).plan
    named = plan.replace_action_instances(lambda one: ActionInstance(originals[one.action.name]))
    return from_up_plan(named.replace_action_instances(grounded.map_back_action_instance), situation)


def _renamed(action: Any, names: dict[Any, Any]) -> Any:
    from unified_planning.model import DurativeAction

    copy = DurativeAction(action.name)
    copy.set_fixed_duration(action.duration.lower.substitute(names).simplify())
    for interval, conditions in action.conditions.items():
        for condition in conditions:
            copy.add_condition(interval, condition.substitute(names))
    for timing, effects in action.effects.items():
        for effect in effects:
            kinds = {"ASSIGN": copy.add_effect, "INCREASE": copy.add_increase_effect}
            add = kinds.get(effect.kind.name, copy.add_decrease_effect)
            add(timing, effect.fluent.substitute(names), effect.value.substitute(names).simplify())
    return copy


@pytest.mark.slow
@pytest.mark.parametrize("planner", COMMANDS)
def test_an_installed_planner_solves_a_tight_problem(planner: str) -> None:
    if shutil.which(planner) is None:
        pytest.skip(f"there is no executable {planner} here")
    for seconds in doubling_budgets(3):
        *improved, end = engine(COMMANDS[planner]).solve(tight(), Budget(seconds=seconds))
        if improved:
            break
    assert improved, end.detail
    assert check(tight(), improved[-1].plan).valid


def told(folder: Path, place: str, prints: str = "") -> tuple[str, list[Improved | Finished]]:
    """Return the problem that a planner gets by a place of its command line, and the events if it prints a text."""
    script = folder / "planner.py"
    script.write_text(f"import shutil, sys\nshutil.copy(sys.argv[2], {str(folder / 'told')!r})\nprint({prints!r})\n")
    name = f"cmd:{shlex.quote(sys.executable)} -SE {shlex.quote(str(script))} {{domain}} {place}"
    events = list(engine(name).solve(tight(), Budget(seconds=HANG_S)))
    return (folder / "told").read_text(), events


def test_a_planner_gets_batteries_only_if_its_command_asks_for_them(tmp_path: Path) -> None:
    assert f"(:domain {PLAIN})" in told(tmp_path, "{problem}")[0]
    assert f"(:domain {WITH_BATTERIES})" in told(tmp_path, "{problem_batteries}")[0]
    assert isinstance(engine("cmd:true {domain} {problem}"), BatteryEngine)
    assert isinstance(engine("cmd:true {domain} {problem_batteries}"), External)


def test_a_claim_that_there_is_no_plan_is_no_proof_with_batteries(tmp_path: Path) -> None:
    _, events = told(tmp_path, "{problem_batteries}", "problem has been proven unsolvable")
    (end,) = events
    assert isinstance(end, Finished)
    assert end.outcome is Outcome.NO_PLAN
    assert "batteries are approximate in PDDL" in end.detail


HASTY = """\
0: (move c1 carrier_type c1_start m1) [10]
11: (undock r1 rover_type c1 m1) [5]
17: (explore r1 rover_type m1 t1) [4]
22: (move r1 rover_type t1 m1) [4]
27: (dock r1 rover_type c1 m1) [10]
38: (move c1 carrier_type m1 m2) [30]
69: (undock r1 rover_type c1 m2) [5]
75: (explore r1 rover_type m2 t2) [4]
80: (move r1 rover_type t2 m2) [4]
85: (dock r1 rover_type c1 m2) [10]
"""


def test_a_plan_whose_rover_has_to_charge_longer_counts_with_the_wait_that_it_needs(tmp_path: Path) -> None:
    _, events = told(tmp_path, "{problem_batteries}", HASTY)
    (plan,) = (event.plan for event in events if isinstance(event, Improved))
    assert check(tight(), plan).valid
    assert 120_000 < plan.makespan_ms < 135_000
    _, events = told(tmp_path, "{problem_batteries}", HASTY.replace("t1 m1) [4]", "t1 m2) [4]"))
    (end,) = events
    assert isinstance(end, Finished)
    assert "1 refused" in end.detail
