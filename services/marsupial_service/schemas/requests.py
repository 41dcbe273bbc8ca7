"""The bodies of requests."""

from typing import Annotated, Literal

from pydantic import RootModel

from marsupial.model.plan import Action, ActionName
from marsupial.model.planning import Budget
from marsupial_service.schemas.base import (
    Milliseconds,
    Name,
    OptionalField,
    RequestBody,
    at_most,
    by_key,
    converted,
    described_by,
    variant,
    within,
)
from marsupial_service.schemas.mapstates import MapStateBody
from marsupial_service.schemas.situations import SituationBody


class SecondsBudget(RequestBody):
    """A budget in wall-clock seconds."""

    seconds: Annotated[float, within("budget_s")]


class StepsBudget(RequestBody):
    """A budget in steps, which gives the same plan each time."""

    steps: Annotated[int, within("budget_steps")]


BudgetBody = Annotated[
    Budget,
    converted(
        Annotated[
            Annotated[SecondsBudget, variant("seconds")] | Annotated[StepsBudget, variant("steps")],
            by_key("seconds", "steps"),
        ],
        Budget,
    ),
]


class _JobFields(RequestBody):
    planner: Name = "auto"
    budget: OptionalField[BudgetBody] = None


class SituationJobBody(_JobFields):
    """A job that plans for a given situation."""

    situation: Annotated[object, described_by(SituationBody)]


class MapStateJobBody(_JobFields):
    """A job that analyses a map state and plans for the resulting situation."""

    map_state: MapStateBody


class JobBody(RootModel[object]):
    """A planning job: a situation or a map state, a planner and its budget."""

    root: Annotated[
        Annotated[SituationJobBody, variant("situation")] | Annotated[MapStateJobBody, variant("map_state")],
        by_key("situation", "map_state"),
    ]


_MOST_PARTS = 10


class AnalysisBody(RequestBody):
    """A map state to analyse; `include` selects the parts of the answer, all by default."""

    map_state: MapStateBody
    include: OptionalField[
        Annotated[list[Literal["places", "reach", "frontiers", "costs"]], at_most(_MOST_PARTS, "words")]
    ] = None


class ActionBody(RequestBody):
    """An action of a plan."""

    name: Annotated[ActionName, converted(Literal["move", "explore", "dock", "undock"], ActionName)]
    robot: Name
    carrier: OptionalField[Name] = None
    origin: OptionalField[Name] = None
    place: Name
    start_ms: Annotated[int, within("start_ms")]
    duration_ms: Milliseconds


class ActionsPlan(RequestBody):
    """A plan as a list of actions."""

    actions: Annotated[list[Annotated[Action, converted(ActionBody, Action)]], at_most("actions", "actions")]


class TextPlan(RequestBody):
    """A plan in the text format of the planning competitions."""

    ipc: Annotated[str, at_most("plan_bytes", "characters")]


class ValidationBody(RequestBody):
    """A situation, and a plan to check for it."""

    situation: Annotated[object, described_by(SituationBody)]
    plan: Annotated[
        Annotated[ActionsPlan, variant("actions")] | Annotated[TextPlan, variant("ipc")], by_key("actions", "ipc")
    ]
