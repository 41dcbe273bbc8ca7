"""One mission of a comparison, from its scenario to its row; and the worker of the local pool, which does many."""

from __future__ import annotations

from collections.abc import Mapping
from time import process_time

from marsupial.bench.compare.coverage import EVERY_MS, CoverageSampler
from marsupial.bench.compare.plan import Case, Trial
from marsupial.bench.compare.rows import ERROR, Curve, Result, Row, Timing
from marsupial.bench.simulate import MissionSummary, reachable_area, simulate
from marsupial.mission.placement import place_team
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
        sampler = CoverageSampler(reachable_area(scenario, place_team(scenario, trial.seed)))
        summary = simulate(
            scenario,
            strategy_name=trial.contender.strategy,
            planner=trial.contender.planner,
            budget=budget,
            seed=trial.seed,
            observer=sampler,
        )
    except Exception as error:
        return Result(row=Row(trial=trial, status=ERROR, reason=f"{type(error).__name__}: {error}"))
    return Result(
        row=_row(trial, summary),
        timing=_timing(trial, summary, process_time() - began),
        curve=Curve(trial=trial, every_s=EVERY_MS / 1000, known=tuple(sampler.known)),
    )


def _row(trial: Trial, summary: MissionSummary) -> Row:
    ended = summary.ended
    return Row(
        trial=trial,
        status=str(ended.status),
        reason=ended.reason,
        exploration_time_s=None if ended.exploration_ms is None else ended.exploration_ms / 1000,
        mission_time_s=ended.t_ms / 1000,
        coverage=round(ended.coverage, 6),
        explored_area_m2=round(ended.explored_area_m2, 6),
        reachable_area_m2=round(ended.reachable_area_m2, 6),
        distance_m=round(sum(metres for _, metres in ended.distance_m), 3),
        quality=round(summary.quality, 6),
        energy_j=round(sum(joules for _, joules in ended.energy_j), 3),
        replans=ended.replans,
        plans_invalid=ended.plans_invalid,
        plans_refused=summary.refused,
        deployments=ended.deployments,
        retrievals=ended.retrievals,
        aboard=len(ended.aboard),
        remaining=len(ended.remaining),
    )


def _timing(trial: Trial, summary: MissionSummary, cpu_s: float) -> Timing:
    planning = summary.planning
    return Timing(
        trial=trial,
        wall_s=round(summary.wall_s, 4),
        cpu_s=round(cpu_s, 4),
        planning_median_s=round(planning.median, 6),
        planning_p95_s=round(planning.p95, 6),
        planning_max_s=round(planning.max, 6),
        planning_total_s=round(planning.total, 6),
        first_plan_s=round(planning.first_plan, 6),
    )
