"""`marsupial compare`: strategies and planners beside each other, over maps, team sizes and seeds."""

from pathlib import Path
from typing import Annotated, Any

import typer

from marsupial.cli.display.messages import warn
from marsupial.cli.options import completing, shared
from marsupial.errors import UsageError
from marsupial.model.bounds import BOUNDS, COMPARE_RUNS, COMPARE_STEPS

_SCENARIOS = "Built-in scenarios, scenario files, nav2 or MovingAI maps."
_SUITE = "Maps of a suite instead: footprint, paper, laser, buildings, or NAME-tuning."
_STRATEGIES = (
    "STRATEGY, STRATEGY:PLANNER or FILE.py:CLASS, comma-separated; the last is the baseline. "
    f"Strategies: {shared.STRATEGIES}. [default: temporal,heuristic; of a suite temporal against all others]"
)
_PLANNER = "Planner for strategies given without one [default: auto, of a suite anytime]."
_RUNS = f"Missions per case, with seeds 1, 2, ... [default: {COMPARE_RUNS}, of a suite 3]"
_STEPS = f"Steps per planning call, reproducible [default: {COMPARE_STEPS}]."
_REPORT = "Rebuild tables, figures and report from the results in this folder."


def compare(
    context: typer.Context,
    scenarios: Annotated[list[str] | None, shared.scenario_argument(_SCENARIOS, metavar="SCENARIO...")] = None,
    strategies: Annotated[
        str | None,
        typer.Option(autocompletion=completing.strategies, help=_STRATEGIES, rich_help_panel="Strategies and planning"),
    ] = None,
    planner: Annotated[str | None, shared.planner_option(_PLANNER)] = None,
    steps: Annotated[int | None, typer.Option(help=_STEPS)] = None,
    budget: Annotated[float | None, typer.Option(help="Seconds per planning call instead, not reproducible.")] = None,
    suite: Annotated[
        str | None,
        typer.Option(autocompletion=completing.suite, help=_SUITE, rich_help_panel="Maps, teams and missions"),
    ] = None,
    carriers: Annotated[str | None, typer.Option(help="Numbers of carriers, such as 1-6 or 2,4.")] = None,
    rovers: Annotated[str | None, typer.Option(help="Numbers of rovers per carrier, such as 1-3.")] = None,
    runs: Annotated[int | None, typer.Option(callback=shared.within(1, 100_000), help=_RUNS)] = None,
    routes: shared.RouteChoice = None,
    interference: shared.KeepApart = False,
    time_limit: shared.TimeLimit = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Output folder; resumes a comparison found in it.", rich_help_panel="Running and output"),
    ] = None,
    report: Annotated[Path | None, typer.Option(help=_REPORT)] = None,
    retry_failed: shared.RetryFailed = False,
    workers: shared.Workers = None,
    ray: shared.RayAddress = None,
    quiet: shared.Quiet = False,
    verbose: shared.Verbose = False,
) -> None:
    """Compare strategies and planners on identical missions.

    Every strategy runs on the same maps, teams, starts and seeds. Rows, tables and figures go to the folder --out.

    Example: marsupial compare lobby --carriers 1-2 --runs 4 --out compared
    """
    from marsupial.bench.compare.arguments import cases_of
    from marsupial.bench.compare.plan import Comparison
    from marsupial.bench.suite.maps import CARRIERS, CONTENDERS, PLANNER, ROVERS, RUNS, suite_named
    from marsupial.cli.work.compare_arguments import contenders, numbers, warn_of_ignored
    from marsupial.cli.work.missions import changed, limits_of
    from marsupial.library.choices import budget_of

    if report is not None:
        given = shared.options_given(context, "scenarios", "report")
        _rebuild(report, [*(["SCENARIO"] if scenarios else []), *given])
        return
    if bool(scenarios) == (suite is not None):
        raise UsageError("needs a SCENARIO or a --suite, not both, or --report with a folder")
    if out is None:
        raise UsageError("--out is missing: the folder to write to")
    limits = limits_of(time_limit)
    chosen = budget_of(budget, COMPARE_STEPS if steps is None and budget is None else steps)
    maps = None if suite is None else suite_named(suite)
    if maps is not None:
        scenarios, runs, planner = maps.sources(), runs or RUNS, planner or PLANNER
        strategies, carriers, rovers = strategies or CONTENDERS, carriers or CARRIERS, rovers or ROVERS
    strategies = strategies or "temporal,heuristic"
    compared = contenders(strategies, planner, chosen)
    limit = None if (steps, budget) == (None, None) else "--steps" if budget is None else "--budget"
    warn_of_ignored(strategies, compared, planner, limit)
    teams = (
        numbers(carriers, "--carriers", BOUNDS["carriers"]),
        numbers(rovers, "--rovers", BOUNDS["rovers_per_carrier"]),
    )
    options: dict[str, Any] = {"routes": routes, "interference": interference, "limits": limits}
    cases = {case: changed(one, **options) for case, one in cases_of(scenarios or [], *teams, warn).items()}
    from marsupial.cli.work import comparing  # takes a second: only now is it clear that it is needed

    comparison = Comparison(
        contenders=tuple(compared),
        own={one.strategy: found for one, found in compared.items() if not isinstance(found, str)},
        scenarios=cases,
        runs=runs or COMPARE_RUNS,
        budget=chosen,
        suite=suite,
        first_seed=1 if maps is None else maps.first_seed,
    )
    comparing.carry_out(comparison, out, workers=workers, ray=ray, retry_failed=retry_failed)


def _rebuild(folder: Path, others: list[str]) -> None:
    """Write the documents of a folder anew; refuse the other options given, which it can't take."""
    if others:
        raise UsageError(f"--report takes no {' and no '.join(others)}: it only reads and writes its folder")
    from marsupial.cli.work.comparing import report

    report(folder)
