"""From the JSON of a request, whose shape is known to be right, to situations, budgets and plans.

The library's readers say what is wrong; here their paths become JSON pointers, and what is larger than the limits is
refused before it is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from marsupial.errors import InputError
from marsupial.formats.pddl.plantext import read_plan_text
from marsupial.formats.situation import situation_from_fields
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.planning import Budget
from marsupial.model.situation import Situation
from marsupial_service.pointers import of_path
from marsupial_service.problems import Detail, HttpProblem
from marsupial_service.settings import Limits


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


def read_budget(body: Mapping[str, Any], limits: Limits, default_s: float) -> Budget:
    """Return the budget of a request, `default_s` seconds if it says nothing.

    Raises
    ------
    HttpProblem
        If it is beyond the limits.
    """
    budget = body.get("budget", {"seconds": min(default_s, limits.budget_s)})
    kind, most = ("seconds", limits.budget_s) if "seconds" in budget else ("steps", limits.budget_steps)
    if budget[kind] > most:
        raise refuse(f"/budget/{kind}", f"must be at most {most:g}, got {budget[kind]:g}")
    return Budget(**{kind: budget[kind]})


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
