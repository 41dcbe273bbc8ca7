"""From the bodies of requests, whose shape is known to be right, to situations, budgets and plans.

What is wrong is told by the library's errors, with paths into the body; `marsupial_service.app` makes JSON pointers of
them. What is larger than the limits is refused before it is looked at.
"""

from __future__ import annotations

from marsupial.errors import InputError, PlanTextError, Problem, SituationError
from marsupial.formats.fields import Notes
from marsupial.formats.pddl.plansteps import Reading
from marsupial.formats.pddl.plantext import read_plan
from marsupial.formats.situation import check_places, travel_tables
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial.model.situation import Situation, SituationGoal
from marsupial_service.problems import check_count
from marsupial_service.schemas.requests import ActionsPlan, TextPlan
from marsupial_service.schemas.situations import SituationBody
from marsupial_service.settings import ServiceLimits


def refuse(path: str, text: str) -> InputError:
    """Return the error of one field."""
    return InputError([Problem(path, text)])


def situation_of(body: SituationBody, limits: ServiceLimits) -> Situation:
    """Return the situation of a request, which stands in its field ``situation``.

    Raises InputError naming everything that is wrong, or HttpProblem if there is too much of something.
    """
    count = len(body.meetings) + len(body.homes) + len(body.targets)
    check_count("/situation/meetings", count, limits.places, "places")
    notes = Notes("situation")
    starts = [robot.place for robot in body.robots if robot.place is not None]
    places = [*starts, *(target.name for target in body.targets), *body.meetings, *body.homes]
    if body.places is not None:
        check_places(body.places, places, notes)
    tables = travel_tables(body.travel_ms, body.types, len(places), notes.below("travel_ms"))
    notes.check(SituationError)
    try:
        return Situation(
            types=tuple(body.types),
            robots=tuple(body.robots),
            targets=tuple(body.targets),
            meetings=tuple(body.meetings),
            homes=tuple(body.homes),
            travel_ms=tables,
            goal=body.goal or SituationGoal(),
        )
    except SituationError as error:
        notes.take(error)
        raise SituationError(notes.problems) from error


def budget_of(budget: Budget | None, limits: ServiceLimits, default_s: float) -> Budget:
    """Return the budget of a request (`default_s` seconds by default). Raises InputError if it is too large."""
    if budget is None:
        return Budget(seconds=min(default_s, limits.budget_s))
    for key, given, most in (
        ("seconds", budget.seconds, limits.budget_s),
        ("steps", budget.steps, limits.budget_steps),
    ):
        if given is not None and given > most:
            raise refuse(f"budget.{key}", f"must be at most {most:g}, got {given:g}")
    return budget


def reading_of(body: ActionsPlan | TextPlan, situation: Situation) -> Reading:
    """Return the plan of a request (field ``plan``), valid or not. Raises PlanTextError if its text can't be read."""
    if isinstance(body, ActionsPlan):
        return Reading(plan=Plan(actions=tuple(body.actions)))
    try:
        return read_plan(body.ipc, situation)
    except InputError as error:
        raise PlanTextError([Problem("plan.ipc", str(problem)) for problem in error.problems]) from error
