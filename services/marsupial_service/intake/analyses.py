"""From the bodies of analyses and validations to map states and verdicts."""

from __future__ import annotations

from marsupial.planning.checker import check
from marsupial_service.analyses.analysis import INCLUDE, analysis
from marsupial_service.analyses.maps import image_cells, map_state_of
from marsupial_service.analyses.mapstate import MapState
from marsupial_service.analyses.situations import reading_of, situation_of
from marsupial_service.examples.demos import DEMOS
from marsupial_service.intake import counts
from marsupial_service.intake.reading import BodyReader, Digested
from marsupial_service.schemas import answers
from marsupial_service.schemas.mapstates import MapStateBody
from marsupial_service.schemas.requests import AnalysisBody, ValidationBody
from marsupial_service.settings import ServiceLimits


def analysis_of(body: AnalysisBody, _: Digested, limits: ServiceLimits) -> tuple[MapState, frozenset[str]]:
    """Return the map state, and the parts of the analysis that are asked for. Raises InputError with all faults."""
    return map_state_of(body.map_state, limits), INCLUDE if body.include is None else frozenset(body.include)


def verdict_of(body: ValidationBody, _: Digested, limits: ServiceLimits) -> answers.VerdictAnswer:
    """Return the verdict on a plan. Raises InputError if it, or its situation, can't be read."""
    situation = situation_of(body.situation, limits)
    reading = reading_of(body.plan, situation)
    actions, retimed = len(reading.plan.actions), len(reading.mended)
    return answers.VerdictAnswer.of(check(situation, reading.plan), actions=actions, retimed=retimed)


def _cells(body: AnalysisBody) -> int:
    return image_cells(body.map_state.map)


ANALYSIS_READER = BodyReader(model=AnalysisBody, counts=counts.ANALYSIS, make=analysis_of, cells=_cells)
VALIDATION_READER = BodyReader(model=ValidationBody, counts=counts.VALIDATION, make=verdict_of)


def load_analysis() -> None:
    """Analyse a small map."""
    yard = map_state_of(MapStateBody.model_validate(DEMOS["yard"].load()), ServiceLimits())
    analysis(yard, INCLUDE)
