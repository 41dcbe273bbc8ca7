"""From the JSON of a request, whose shape is known to be right, to situations, budgets and plans.

The library's readers say what is wrong; here their paths become JSON pointers, and what is larger than the limits is
refused before it is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from marsupial.errors import InputError
from marsupial.formats.plantext import read_plan_text
from marsupial.formats.situation import situation_from_fields
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.planning import Budget, EngineInfo
from marsupial.model.situation import Situation
from services.pointers import of_path
from services.problems import Detail, HttpProblem
from services.settings import Limits

DEFAULT_BUDGET_S = 5.0


@contextmanager
def refusing(prefix: str, body: object) -> Iterator[None]:
    """Turn what the library finds wrong with `body`, which stands at the pointer `prefix`, into an answer."""
    try:
        yield
    except InputError as error:
        details = [
            Detail(where="pointer", name=prefix + of_path(problem.path, body), text=problem.message)
            for problem in error.problems
        ]
        raise HttpProblem("invalid", errors=details) from error


def refuse(pointer: str, text: str, kind: str = "invalid") -> HttpProblem:
    """Return the problem of one field."""
    return HttpProblem(kind, errors=[Detail(where="pointer", name=pointer, text=text)])


def check_count(pointer: str, count: int, limit: int, noun: str) -> None:
    """Refuse more than the limit allows.

    Raises
    ------
    HttpProblem
        If there are too many.
    """
    if count > limit:
        raise refuse(pointer, f"has {count} {noun}, more than the limit of {limit}", "too-large")


def read_situation(body: Mapping[str, Any], limits: Limits) -> Situation:
    """Return the situation of a request.

    Raises
    ------
    HttpProblem
        Naming everything that is wrong, or what there is too much of.
    """
    situation = body["situation"]
    check_count("/situation/robots", len(situation["robots"]), limits.robots, "robots")
    check_count("/situation/types", len(situation["types"]), limits.robots, "robot types")
    check_count("/situation/targets", len(situation["targets"]), limits.targets, "targets")
    places = len(situation["meetings"]) + len(situation.get("homes", ())) + len(situation["targets"])
    check_count("/situation/meetings", places, limits.places, "places")
    with refusing("/situation", situation):
        return situation_from_fields(situation)


def read_budget(body: Mapping[str, Any], limits: Limits, planner: EngineInfo) -> Budget:
    """Return the budget of a request for a planner.

    Raises
    ------
    HttpProblem
        If it is beyond the limits, or of a kind that the planner can't keep.
    """
    budget = body.get("budget", {"seconds": min(DEFAULT_BUDGET_S, limits.budget_s)})
    if "seconds" in budget:
        if budget["seconds"] > limits.budget_s:
            raise refuse("/budget/seconds", f"must be at most {limits.budget_s:g}, got {budget['seconds']:g}")
        return Budget(seconds=float(budget["seconds"]))
    if not planner.deterministic_steps:
        raise refuse("/budget/steps", f"planner {planner.name} can't count steps: give it a budget in seconds")
    if budget["steps"] > limits.budget_steps:
        raise refuse("/budget/steps", f"must be at most {limits.budget_steps}, got {budget['steps']}")
    return Budget(steps=budget["steps"])


def read_plan(body: Mapping[str, Any], situation: Situation) -> Plan:
    """Return the plan of a request, which need not be valid.

    Raises
    ------
    HttpProblem
        If its text can't be read.
    """
    plan = body["plan"]
    if "actions" in plan:
        return Plan(actions=tuple(_action(fields) for fields in plan["actions"]))
    try:
        return read_plan_text(plan["ipc"], situation)
    except InputError as error:
        details = [Detail(where="pointer", name="/plan/ipc", text=str(problem)) for problem in error.problems]
        raise HttpProblem("invalid", errors=details) from error


def _action(fields: Mapping[str, Any]) -> Action:
    return Action(
        name=ActionName(fields["name"]),
        start_ms=fields["start_ms"],
        duration_ms=fields["duration_ms"],
        robot=fields["robot"],
        place=fields["place"],
        carrier=fields.get("carrier"),
        origin=fields.get("origin"),
    )
