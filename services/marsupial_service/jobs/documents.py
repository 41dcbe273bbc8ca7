"""Plans and events as JSON: what is kept in the store and sent to clients as it is."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from marsupial.model.plan import Action, ActionName, Plan
from marsupial_service.moments import timestamp


def line(document: object) -> str:
    """Return JSON in one line, whatever a reader takes for the end of a line."""
    return json.dumps(document, separators=(",", ":"), allow_nan=False)


def action_document(action: Action) -> dict[str, object]:
    """Return an action's fields; those that don't apply are left out."""
    who = {"carrier": action.carrier, "origin": action.origin}
    return {
        "name": action.name.value,
        "robot": action.robot,
        **{key: value for key, value in who.items() if value is not None},
        "place": action.place,
        "start_ms": action.start_ms,
        "duration_ms": action.duration_ms,
    }


def actions_text(plan: Plan) -> str:
    """Return the actions of a plan as JSON in one line."""
    return line([action_document(action) for action in plan.actions])


def plan_of(text: str) -> Plan:
    """Return the plan whose `actions_text` this is."""
    return Plan(actions=tuple(_action(fields) for fields in json.loads(text)))


def _action(fields: Mapping[str, Any]) -> Action:
    return Action(
        name=ActionName(fields["name"]),
        start_ms=int(fields["start_ms"]),
        duration_ms=int(fields["duration_ms"]),
        robot=str(fields["robot"]),
        place=str(fields["place"]),
        carrier=str(fields["carrier"]) if "carrier" in fields else None,
        origin=str(fields["origin"]) if "origin" in fields else None,
    )


def plan_event(revision: int, makespan_ms: int, found_after_ms: int, at_ms: int, actions: str) -> str:
    """Return the data of a plan's event; `actions` is its `actions_text`."""
    head = line(
        {
            "revision": revision,
            "makespan_ms": makespan_ms,
            "found_after_ms": found_after_ms,
            "at": timestamp(at_ms),
        }
    )
    return f'{head[:-1]},"actions":{actions}}}'
