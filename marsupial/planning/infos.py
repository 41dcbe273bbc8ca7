"""What there is to say of marsupial's own engines, apart from their code, which takes a second to import."""

from __future__ import annotations

from marsupial.model.objective import ObjectiveName
from marsupial.model.planning import EngineInfo

ANYTIME = EngineInfo(
    name="anytime",
    summary="annealing on exact schedules; a plan at once, then better ones; proves some makespans best",
    licence="Apache-2.0",
    anytime=True,
    proves_optimality=True,
    deterministic_steps=True,
    objectives=(ObjectiveName.MAKESPAN, ObjectiveName.PRICED_ARRIVAL),
)

AUTO = EngineInfo(
    name="auto",
    summary="the default: marsupial's own side by side, the best plan of all",
    licence="Apache-2.0",
    anytime=True,
    proves_optimality=True,
    deterministic_steps=True,
    objectives=(ObjectiveName.MAKESPAN, ObjectiveName.PRICED_ARRIVAL),
)

EXACT = EngineInfo(
    name="exact",
    summary="branch and bound over docks and undocks; proves makespans best, up to a dozen targets",
    licence="Apache-2.0",
    anytime=True,
    proves_optimality=True,
    deterministic_steps=True,
)

GREEDY = EngineInfo(
    name="greedy",
    summary="list scheduling; always answers, never proves a plan best",
    licence="Apache-2.0",
    anytime=True,
    deterministic_steps=True,
)
