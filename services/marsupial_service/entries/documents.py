"""Plans and events as JSON: what is kept in the store and sent to clients as it is."""

from __future__ import annotations

import json
from typing import Any

from marsupial.model.plan import Action, ActionName, Plan
from marsupial_service.moments import timestamp
from marsupial_service.schemas.answers import ActionAnswer

_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


def line(document: object) -> str:
    """Return JSON in one line, whatever a reader takes for the end of a line."""
    return _ENCODER.encode(document)


def rounded(point_m: tuple[float, float]) -> list[float]:
    """Return a point in metres to the micrometre."""
    return [round(metres, 6) for metres in point_m]


def action_document(action: Action) -> dict[str, Any]:
    """Return an action's fields; those that don't apply are left out."""
    return ActionAnswer.of(action).model_dump()


def actions_text(plan: Plan) -> str:
    """Return the actions of a plan as JSON in one line."""
    return line([action_document(action) for action in plan.actions])


def plan_of(text: str) -> Plan:
    """Return the plan whose `actions_text` this is."""
    actions = (Action(**{**fields, "name": ActionName(fields["name"])}) for fields in json.loads(text))
    return Plan(actions=tuple(actions))


def plan_event(revision: int, makespan_ms: int, found_after_ms: int, at_ms: int, actions: str) -> str:
    """Return the data of a plan's event; `actions` is its `actions_text`."""
    at = timestamp(at_ms)
    head = line({"revision": revision, "makespan_ms": makespan_ms, "found_after_ms": found_after_ms, "at": at})
    return f'{head[:-1]},"actions":{actions}}}'
