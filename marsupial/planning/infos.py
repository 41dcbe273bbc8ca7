"""Descriptions of marsupial's own engines, apart from their code, which takes a second to import."""

from functools import partial

from marsupial.model.objective import ObjectiveName
from marsupial.model.planning import EngineInfo

_EngineInfo = partial(EngineInfo, licence="Apache-2.0", anytime=True, deterministic_steps=True)
_BOTH = (ObjectiveName.MAKESPAN, ObjectiveName.PRICED_ARRIVAL)

ANYTIME = _EngineInfo(
    name="anytime",
    summary="annealing on exact schedules; a plan at once, then better ones; proves some makespans best",
    proves_optimality=True,
    objectives=_BOTH,
)
AUTO = _EngineInfo(
    name="auto",
    summary="the default: marsupial's own side by side, the best plan of all",
    proves_optimality=True,
    objectives=_BOTH,
)
EXACT = _EngineInfo(
    name="exact",
    summary="branch and bound over docks and undocks; proves makespans best, up to a dozen targets",
    proves_optimality=True,
)
GREEDY = _EngineInfo(name="greedy", summary="list scheduling; always answers, never proves a plan best")
