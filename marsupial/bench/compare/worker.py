"""A worker of the local pool: a process that carries out one mission after another.

Imports, compiled code and scenarios are there once for all its missions.
"""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.bench.compare.plan import Case, Trial
from marsupial.bench.compare.trial import carry_out
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial.processes.channel import Channel

Terms = tuple[Mapping[Case, Scenario], Budget]
"""What a worker starts with."""

READY = None
"""What a worker says first."""


def serve(terms: Terms, channel: Channel) -> None:
    """Say that it is ready, then take trials and send their results back until it is ended; the function of a job."""
    scenarios, budget = terms
    channel.send(READY)
    while isinstance(trial := channel.receive(), Trial):
        channel.send(carry_out(trial, scenarios[trial.case], budget))
