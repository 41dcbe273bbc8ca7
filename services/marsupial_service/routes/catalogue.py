"""The planners, demo data and limits of the service."""

from dataclasses import fields
from typing import Annotated

from fastapi import APIRouter, Path, Response

from marsupial.wording import unknown_name
from marsupial_service.examples.demos import DEMOS
from marsupial_service.http.answers import json_answer
from marsupial_service.http.openapi import errors
from marsupial_service.http.routing import PlanRoute
from marsupial_service.planners import planner_infos
from marsupial_service.problems import HttpProblem
from marsupial_service.routes.parameters import ServiceState
from marsupial_service.schemas import answers

router = APIRouter(prefix="/v1", route_class=PlanRoute, tags=["catalogue"])


@router.get("/planners", response_model=answers.PlannersAnswer, responses=errors())
async def list_planners(state: ServiceState) -> Response:
    """List the planners, and why some are not available here."""
    infos = planner_infos(state.settings.planners)
    found = [answers.PlannerAnswer.of(info, available=info.missing is None) for info in infos]
    return json_answer(answers.PlannersAnswer(planners=found))


@router.get("/demo-data", response_model=answers.DemoListAnswer, responses=errors())
async def list_demo_data() -> Response:
    """List ready-made requests for /v1/jobs."""
    items = [
        answers.DemoItemAnswer(name=name, kind=demo.kind, summary=demo.summary, href=f"/v1/demo-data/{name}")
        for name, demo in DEMOS.items()
    ]
    return json_answer(answers.DemoListAnswer(demo_data=items))


@router.get("/demo-data/{name}", response_model=answers.DemoJobAnswer, responses=errors("not-found"))
async def get_demo(name: Annotated[str, Path(description="Name of a demo.")]) -> Response:
    """Return a ready-made request for /v1/jobs."""
    if name not in DEMOS:
        raise HttpProblem("not-found", unknown_name("demo", name, DEMOS))
    return json_answer(answers.DemoJobAnswer.model_validate(DEMOS[name].request()))


@router.get("/limits", response_model=answers.LimitListAnswer, responses=errors())
async def get_limits(state: ServiceState) -> Response:
    """Return all limits and their meanings."""
    held = state.settings.limits
    shown = {
        one.name: answers.LimitAnswer(value=getattr(held, one.name), meaning=one.metadata["meaning"])
        for one in fields(held)
    }
    return json_answer(answers.LimitListAnswer(limits=shown))
