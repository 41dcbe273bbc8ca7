"""One mission of a comparison, from its scenario to its row; and the worker of the local pool, which does many."""

from __future__ import annotations

from collections.abc import Mapping
from time import process_time

from marsupial.bench.compare.coverage import EVERY_MS, CoverageSampler
from marsupial.bench.compare.plan import Case, Trial
from marsupial.bench.compare.rows import ERROR, Curve, Result, Row, Timing, metrics_of
from marsupial.library.missions import simulate
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial.processes.channel import Channel

Terms = tuple[Mapping[Case, Scenario], Budget]
"""What a worker starts with."""

READY = None
"""What a worker says first."""


def serve(terms: Terms, channel: Channel) -> None:
    """Take trials and send their results back until there is no other one; the function of a job.

    Imports, compiled code and scenarios are there once for all of them.
    """
    scenarios, budget = terms
    channel.send(READY)
    while isinstance(trial := channel.receive(), Trial):
        channel.send(carry_out(trial, scenarios[trial.case], budget))


def carry_out(trial: Trial, scenario: Scenario, budget: Budget) -> Result:
    """Run a mission and return what is kept of it; one that raises an exception has a row that says so."""
    began = process_time()
    try:
        sampler = CoverageSampler()
        summary = simulate(
            scenario,
            strategy=trial.contender.strategy,
            planner=trial.contender.planner,
            budget=budget,
            seed=trial.seed,
            observer=sampler,
        )
    except Exception as error:
        return Result(row=Row(trial=trial, status=ERROR, reason=f"{type(error).__name__}: {error}"))
    return Result(
        row=Row(trial=trial, status=str(summary.status), reason=summary.reason, **metrics_of(Row, summary)),
        timing=Timing(trial=trial, cpu_s=round(process_time() - began, 4), **metrics_of(Timing, summary)),
        curve=Curve(trial=trial, every_s=EVERY_MS / 1000, known=tuple(sampler.known)),
    )
