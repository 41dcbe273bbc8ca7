"""`marsupial compare`: strategies and planners beside each other, over maps, team sizes and seeds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.options import completing
from marsupial.cli.options.late_help import STRATEGIES
from marsupial.cli.options.shared import (
    COMPARE_STEPS,
    KeepApart,
    Quiet,
    RayAddress,
    RetryFailed,
    RouteChoice,
    TimeLimit,
    Verbose,
    Workers,
    options_given,
)


def compare(
    context: typer.Context,
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(
            autocompletion=completing.scenario_or_file,
            metavar="SCENARIO...",
            help="Built-in scenarios, scenario files, nav2 or MovingAI maps.",
        ),
    ] = None,
    strategies: Annotated[
        str,
        typer.Option(
            autocompletion=completing.strategies,
            help=f"STRATEGY or STRATEGY:PLANNER, comma-separated; the last is the baseline. Strategies: {STRATEGIES}.",
        ),
    ] = "temporal,heuristic",
    planner: Annotated[
        str | None,
        typer.Option(
            "--planner",
            "-p",
            autocompletion=completing.planner,
            help="Planner for strategies given without one [default: auto].",
        ),
    ] = None,
    carriers: Annotated[str | None, typer.Option(help="Numbers of carriers, such as 1-6 or 2,4.")] = None,
    rovers: Annotated[str | None, typer.Option(help="Numbers of rovers per carrier, such as 1-3.")] = None,
    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Missions per case, with seeds 1, 2, ...")] = 30,
    steps: Annotated[
        int | None, typer.Option(help=f"Steps per planning call, reproducible [default: {COMPARE_STEPS}].")
    ] = None,
    budget: Annotated[float | None, typer.Option(help="Seconds per planning call instead, not reproducible.")] = None,
    routes: RouteChoice = None,
    interference: KeepApart = False,
    time_limit: TimeLimit = None,
    workers: Workers = None,
    ray: RayAddress = None,
    out: Annotated[Path | None, typer.Option(help="Output folder; resumes a comparison found in it.")] = None,
    retry_failed: RetryFailed = False,
    report: Annotated[
        Path | None, typer.Option(help="Rebuild tables, figures and report from the results in this folder.")
    ] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compare strategies and planners on identical missions.

    Every strategy runs on the same maps, teams, starts and seeds. Rows, tables and figures go to the folder --out.

    Example: marsupial compare lobby --carriers 1-2 --runs 4 --out compared
    """
    from marsupial.bench.compare.plan import Comparison
    from marsupial.cli.work.compare_arguments import cases_of, contenders, numbers, warn_of_ignored
    from marsupial.cli.work.missions import kept_apart, limits_of, routed
    from marsupial.errors import UsageError
    from marsupial.library.choices import budget_of
    from marsupial.model.bounds import BOUNDS

    if report is not None:
        others = options_given(context, "report", "quiet", "verbose")
        if others:
            raise UsageError(f"--report takes no {' and no '.join(others)}: it only reads and writes its folder")
        from marsupial.cli.work.comparing import report as write_report

        write_report(report)
        return
    if not scenarios:
        raise UsageError("needs a SCENARIO, or --report with a folder")
    if out is None:
        raise UsageError("needs --out with the folder to write to")
    limits = limits_of(time_limit)
    chosen = budget_of(budget, COMPARE_STEPS if steps is None and budget is None else steps)
    compared = contenders(strategies, planner, chosen)
    limit = None if (steps, budget) == (None, None) else "--steps" if budget is None else "--budget"
    warn_of_ignored(strategies, compared, planner, limit)
    teams = (
        numbers(carriers, "--carriers", BOUNDS["carriers"]),
        numbers(rovers, "--rovers", BOUNDS["rovers_per_carrier"]),
    )
    cases = {
        case: kept_apart(routed(scenario, routes), interference)
        for case, scenario in cases_of(scenarios, *teams, limits).items()
    }
    from marsupial.cli.work import comparing  # takes a second: only now is it clear that it is needed

    comparison = Comparison(contenders=compared, scenarios=cases, runs=runs, budget=chosen)
    comparing.carry_out(comparison, out, workers=workers, ray=ray, retry_failed=retry_failed)
