"""Plans and events as JSON, stored and sent to clients unchanged."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel

from marsupial.model.plan import Action, ActionName, Plan
from marsupial_service.schemas.answers import ActionAnswer

_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


def line(document: object) -> str:
    """Return JSON in one line, without any character that a reader may take for a line break."""
    return _ENCODER.encode(document)


def rounded(point_m: tuple[float, float]) -> list[float]:
    """Return a point in metres, rounded to micrometres."""
    return [round(metres, 6) for metres in point_m]


def text_of(document: BaseModel) -> str:
    """Return a document as JSON in one line."""
    return line(document.model_dump())


def text_with(document: Mapping[str, object], **more: str) -> str:
    """Return a document as JSON in one line, with `more` fields that are JSON text already."""
    return "".join([line(document)[:-1], *(f',"{name}":{text}' for name, text in more.items()), "}"])


def actions_text(plan: Plan) -> str:
    """Return the actions of a plan as JSON in one line."""
    return line([ActionAnswer.of(action).model_dump() for action in plan.actions])


def plan_of(actions: Iterable[Mapping[str, Any]]) -> Plan:
    """Return the plan with these actions, given as JSON documents."""
    return Plan(actions=tuple(Action(**{**fields, "name": ActionName(fields["name"])}) for fields in actions))
