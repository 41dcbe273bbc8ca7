"""The canonical problem in the unified-planning library, plans read back, and that library's verdict on a plan.

The library takes two seconds to import and prints credits, so it is imported here on first use, with the credits off.

Its validator simulates a plan exactly: an action may start at any time after what it depends on, however little, while
ours asks for `EPSILON_MS` (in whole ms that is the same). It ignores the problem's epsilon. It refuses two robots that
finish exploring one target at the very same moment, which PDDL allows. It would raise an error for a drive that has no
`path_cost`, so `up_validate` gives it 0 for what is unknown; such a drive has no `path` either.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any

from marsupial.errors import InvalidPlanError
from marsupial.formats.pddl.domain import domain_of, domain_text
from marsupial.formats.pddl.plansteps import Step, reading_of
from marsupial.formats.pddl.text import problem_text
from marsupial.model import Plan, Situation


@dataclass(frozen=True, slots=True, kw_only=True)
class UpVerdict:
    """The verdict of unified-planning on a plan; `detail` is the reason if it is invalid and a reason is given."""

    valid: bool
    detail: str = ""


def up_problem(situation: Situation, *, name: str = "exploration", records: bool = True) -> Any:
    """Return the library's problem for our domain and `problem_text(situation, name=name, records=records)`."""
    from unified_planning.io import PDDLReader

    _library()
    return PDDLReader().parse_problem_string(
        domain_text(domain_of(situation)), problem_text(situation, name=name, records=records)
    )


def from_up_plan(plan: Any, situation: Situation) -> Plan:
    """Return the plan for a time-triggered plan of the canonical problem, in whole ms.

    Raises
    ------
    PlanTextError
        With every action that means nothing for `situation`.
    """
    steps = [
        Step(
            start=Fraction(start),
            name=instance.action.name,
            args=tuple(arg.object().name for arg in instance.actual_parameters),
            duration=None if duration is None else Fraction(duration),
            where=f"actions[{i}]",
        )
        for i, (start, instance, duration) in enumerate(plan.timed_actions)
    ]
    return reading_of(steps, situation).plan


def up_validate(situation: Situation, plan: Plan) -> UpVerdict:
    """Return the verdict of unified-planning's validator on `plan`, independent of our checker.

    A plan that can't be said in PDDL (see `to_up_plan`) is invalid.
    """
    from unified_planning.engines.results import ValidationResultStatus

    from marsupial.library.up_engine import to_up_plan

    shortcuts = _library()
    problem = up_problem(situation, records=False)
    for fluent in problem.fluents:
        if fluent.type.is_real_type():
            problem._fluents_defaults[fluent] = shortcuts.Int(0)
    try:
        up_plan = to_up_plan(plan, problem, situation)
    except InvalidPlanError as error:
        return UpVerdict(valid=False, detail=str(error))
    with shortcuts.PlanValidator(name="up_time_triggered_validator") as validator:
        result = validator.validate(problem, up_plan)
    if result.status is ValidationResultStatus.VALID:
        return UpVerdict(valid=True)
    reason = "" if result.reason is None else result.reason.name.lower().replace("_", " ")
    action = "" if result.inapplicable_action is None else f": {result.inapplicable_action}"
    return UpVerdict(valid=False, detail=reason + action)


@cache
def _library() -> Any:
    """Import unified-planning without its credits."""
    import unified_planning.shortcuts as shortcuts

    shortcuts.get_environment().credits_stream = None
    return shortcuts
