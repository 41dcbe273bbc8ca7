"""Convert the bodies of requests to situations, budgets and plans.

The library's errors name fields by their paths; `marsupial_service.problems` converts these to JSON pointers.
"""

from marsupial.errors import InputError, PlanTextError, Problem
from marsupial.formats.pddl.plansteps import Reading
from marsupial.formats.pddl.plantext import read_plan
from marsupial.formats.situation import situation_in
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial.model.situation import Situation
from marsupial_service.problems import check_count
from marsupial_service.schemas.requests import ActionsPlan, TextPlan
from marsupial_service.settings import ServiceLimits


def field_error(path: str, text: str) -> InputError:
    return InputError([Problem(path, text)])


def situation_of(document: object, limits: ServiceLimits) -> Situation:
    """Return the situation of a request, which stands in its field ``situation``.

    Raises InputError naming everything that is wrong, or HttpProblem if there is too much of something.
    """
    found = situation_in(document, "situation")
    count = len(found.meetings) + len(found.homes) + len(found.chargers) + len(found.targets)
    check_count("/situation/meetings", count, limits.places, "places")
    return found


def budget_of(budget: Budget | None, limits: ServiceLimits, default_s: float) -> Budget:
    """Return the budget of a request (`default_s` seconds by default). Raises InputError if it is too large."""
    if budget is None:
        return Budget(seconds=min(default_s, limits.budget_s))
    given_and_most = {"seconds": (budget.seconds, limits.budget_s), "steps": (budget.steps, limits.budget_steps)}
    for key, (given, most) in given_and_most.items():
        if given is not None and given > most:
            raise field_error(f"budget.{key}", f"must be at most {most:g}, got {given:g}")
    return budget


def parsed_plan(body: ActionsPlan | TextPlan, situation: Situation) -> Reading:
    """Return the plan of a request (field ``plan``), valid or not. Raises PlanTextError if its text can't be read."""
    if isinstance(body, ActionsPlan):
        return Reading(plan=Plan(actions=tuple(body.actions)))
    try:
        return read_plan(body.ipc, situation)
    except InputError as error:
        raise PlanTextError([Problem("plan.ipc", str(problem)) for problem in error.problems]) from error
