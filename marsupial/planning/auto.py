"""The default planner: annealing at once."""

from __future__ import annotations

from marsupial.model.planning import EngineInfo
from marsupial.planning.anytime.engine import Anytime
from marsupial.planning.portfolio import Member, Portfolio

INFO = EngineInfo(
    name="auto",
    summary="the default: anytime, beside it what proves small situations; the best of all",
    licence="Apache-2.0",
    anytime=True,
    proves_optimality=True,
    deterministic_steps=True,
)


def auto() -> Portfolio:
    """Return the engine."""
    return Portfolio(INFO, Member(name="anytime", make=Anytime))
