"""Convert the bodies of jobs to stored requests, those of analyses to map states, those of validations to verdicts."""

import json
from collections.abc import Mapping

from marsupial.errors import UsageError
from marsupial.model.planning import EngineInfo
from marsupial.planning.checker import check
from marsupial_service.analyses.analysis import INCLUDE, analysis
from marsupial_service.analyses.maps import MapState, image_cells, map_state_of
from marsupial_service.analyses.situations import budget_of, field_error, parsed_plan, situation_of
from marsupial_service.entries.documents import line
from marsupial_service.examples.demos import DEMOS
from marsupial_service.intake.missions import known_map_text
from marsupial_service.intake.reading import BodyReader, ParsedBody
from marsupial_service.jobs.records import PackedRequest
from marsupial_service.planners import planner_info
from marsupial_service.schemas import answers
from marsupial_service.schemas.mapstates import MapStateBody
from marsupial_service.schemas.requests import AnalysisBody, JobBody, MapStateJobBody, SituationJobBody, ValidationBody
from marsupial_service.settings import ServiceLimits

DEFAULT_BUDGET_S = 5.0


def job_of(body: JobBody, sent: ParsedBody, limits: ServiceLimits, planners: Mapping[str, str]) -> PackedRequest:
    """Return the job of a request; `planners` are the operator's. Raises InputError naming all that is wrong."""
    job: SituationJobBody | MapStateJobBody = body.root
    info = _planner(job.planner, planners)
    budget = budget_of(job.budget, limits, DEFAULT_BUDGET_S)
    if budget.steps is not None and not info.deterministic_steps:
        raise field_error("budget.steps", f"planner {job.planner!r} does not support steps; give a budget in seconds")
    if isinstance(job, SituationJobBody):  # only to check that it can be read: the worker reads it again
        situation_of(job.situation, limits)
    else:
        map_state_of(job.map_state, limits)
    return PackedRequest.of(planner=job.planner, budget=budget, digest=sent.digest, text=sent.text)


def _planner(name: str, planners: Mapping[str, str]) -> EngineInfo:
    try:
        info = planner_info(name, planners)
    except UsageError as error:
        raise field_error("planner", str(error)) from error
    if info.missing is not None:
        raise field_error("planner", f"planner {name!r} is not available here: {info.missing}")
    return info


def job_map_text(request: tuple[str, ServiceLimits]) -> bytes | None:
    """Return the map in what was sent for a job, as JSON, None if there is none."""
    source, limits = request
    job = JobBody.model_validate(json.loads(source)).root
    return known_map_text(map_state_of(job.map_state, limits).grid) if isinstance(job, MapStateJobBody) else None


def _cells(body: JobBody | AnalysisBody) -> int:
    request = body.root if isinstance(body, JobBody) else body
    return 0 if isinstance(request, SituationJobBody) else image_cells(request.map_state.map)


def situation_text(source: str) -> bytes | None:
    """Return the situation in what was sent for a job, as JSON; None if that was a map state."""
    sent = json.loads(source)
    return line({"situation": sent["situation"], "places": None}).encode() if "situation" in sent else None


def analysis_of(body: AnalysisBody, _: ParsedBody, limits: ServiceLimits) -> tuple[MapState, frozenset[str]]:
    """Return the map state, and the requested parts of the analysis. Raises InputError with all faults."""
    return map_state_of(body.map_state, limits), INCLUDE if body.include is None else frozenset(body.include)


def verdict_of(body: ValidationBody, _: ParsedBody, limits: ServiceLimits) -> answers.VerdictAnswer:
    """Return the verdict on a plan. Raises InputError if it, or its situation, can't be read."""
    situation = situation_of(body.situation, limits)
    reading = parsed_plan(body.plan, situation)
    actions, retimed = len(reading.plan.actions), len(reading.mended)
    return answers.VerdictAnswer.of(check(situation, reading.plan), actions=actions, retimed=retimed)


JOB_READER = BodyReader(model=JobBody, make=job_of, cells=_cells)
ANALYSIS_READER = BodyReader(model=AnalysisBody, make=analysis_of, cells=_cells, needs_quota=True)
VALIDATION_READER = BodyReader(model=ValidationBody, make=verdict_of, needs_quota=True)


def load_analysis() -> None:
    """Analyse a small map."""
    yard = map_state_of(MapStateBody.model_validate(DEMOS["yard"].load()), ServiceLimits())
    analysis(yard, INCLUDE)
