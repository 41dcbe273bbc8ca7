"""Simulated missions: list the options, create a mission."""

from functools import cache
from typing import Annotated

from fastapi import APIRouter, Body, Response

from marsupial.errors import MarsupialError, ScenarioError
from marsupial.generators.builtin import DEFAULT_CARRIERS, DEFAULT_ROVERS, SCENARIOS
from marsupial.model.planning import Budget
from marsupial.model.robots import Role
from marsupial.strategies.registry import asks_planner, check_suits, strategy, strategy_infos, strategy_names
from marsupial_service.http.answers import json_answer, text_answer
from marsupial_service.http.openapi import errors
from marsupial_service.intake.missions import DEFAULT_BUDGET_S
from marsupial_service.intake.reading import ReceivedBody, read
from marsupial_service.intake.simulations import PREVIEW_READER, SIMULATION_READER
from marsupial_service.planners import planner_infos
from marsupial_service.routes.missions import MISSION_STORED, MissionRoute, created
from marsupial_service.routes.parameters import IdempotencyKey, Owner, ServiceState
from marsupial_service.schemas import answers, offers
from marsupial_service.schemas.base import described_by
from marsupial_service.schemas.simulations import DEFAULT_PLANNER, DEFAULT_SEED, DEFAULT_STRATEGY, SimulationBody

router = APIRouter(prefix="/v1", route_class=MissionRoute, tags=["missions"])

# strategies are made with this planner to see which teams they suit
_TRIED = "greedy"


@router.get("/scenarios", response_model=offers.ScenariosAnswer, responses=errors())
async def list_scenarios(state: ServiceState, owner: Owner) -> Response:
    """List the scenarios, strategies, planners, defaults and room for simulations."""
    settings = state.settings
    usable = [info.name for info in planner_infos(settings.planners) if info.missing is None]
    scenarios = [offers.ScenarioAnswer.of(one, name=name) for name, one in SCENARIOS.items()]
    defaults = offers.SimulationDefaultsAnswer(
        carriers=DEFAULT_CARRIERS,
        rovers=DEFAULT_ROVERS,
        strategy=DEFAULT_STRATEGY,
        planner=DEFAULT_PLANNER,
        seed=DEFAULT_SEED,
        budget=answers.BudgetAnswer(seconds=min(DEFAULT_BUDGET_S, settings.limits.budget_s)),
    )
    room = offers.SimulationRoomAnswer(
        limit=settings.limits.simulations, free=await state.missions.free_simulations(owner)
    )
    found = offers.ScenariosAnswer(
        scenarios=scenarios, strategies=_strategies(), planners=usable, defaults=defaults, simulations=room
    )
    return json_answer(found)


@router.post("/simulations", status_code=201, response_model=answers.MissionAnswer, responses=MISSION_STORED)
async def create_simulation(
    state: ServiceState,
    owner: Owner,
    sent: Annotated[ReceivedBody, Body(), described_by(SimulationBody)],
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Create and start a mission with simulated robots. It accepts no reports, and ends by itself."""
    settings = state.settings
    brief, digest = await read(state.readers, settings.limits, sent, SIMULATION_READER, settings.planners)
    return created(await state.missions.create(brief, digest, owner=owner, idempotency_key=idempotency_key))


@router.post("/simulations/preview", response_model=answers.PreviewAnswer, responses=errors("too-many", body=True))
async def preview_simulation(
    state: ServiceState, sent: Annotated[ReceivedBody, Body(), described_by(SimulationBody)]
) -> Response:
    """Return how the map of a simulation is understood and where its robots would start; nothing is created."""
    return text_answer(await read(state.readers, state.settings.limits, sent, PREVIEW_READER))


@cache
def _strategies() -> list[offers.StrategyAnswer]:
    """Return the available strategies, with the teams that they support."""
    found = []
    summaries = {info.name: info.summary for info in strategy_infos()}
    for name in strategy_names():
        try:
            made = strategy(name, planner=_TRIED, budget=Budget(steps=1))
            asks = asks_planner(name)
        except MarsupialError:
            continue
        fits = [_fits(made, roles) for roles in ((Role.CARRIER, Role.ROVER), (Role.CARRIER,))]
        found.append(
            offers.StrategyAnswer(
                name=name, summary=summaries[name], asks_planner=asks, with_rovers=fits[0], without_rovers=fits[1]
            )
        )
    return found


def _fits(made: object, roles: tuple[Role, ...]) -> bool:
    try:
        check_suits(made, roles)
    except ScenarioError:
        return False
    return True
