"""`marsupial bench`: the project's own benchmarks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

bench = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Run a benchmark of marsupial itself.\n\nExample: marsupial bench paths",
)


@bench.command()
def paths(
    size: Annotated[int, typer.Option(min=64, max=8192, help="Edge of the maps in cells.")] = 1024,
    seed: Annotated[int, typer.Option(min=0, help="Draws the maps.")] = 1,
    repeats: Annotated[int, typer.Option(min=1, help="How often each job is timed; the least counts.")] = 3,
) -> None:
    """Path costs on grids beside scipy's csgraph.

    Example: marsupial bench paths --size 512
    """
    from marsupial.bench.paths import bench_paths, table
    from marsupial.cli.tables import print_text

    print_text(table(bench_paths(size=size, seed=seed, repeats=repeats)) + "\n")


@bench.command()
def planners(
    engines: Annotated[list[str] | None, typer.Option("--engine", help="Only this engine; may be repeated.")] = None,
    instances: Annotated[
        list[str] | None, typer.Option("--instance", help="Only instances like 'rooms-*'; may be repeated.")
    ] = None,
    budgets: Annotated[
        list[float] | None, typer.Option("--budget", help="Seconds; may be repeated [default: 0.1, 1 and 10].")
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", help="Write a row per run there.")] = None,
    update: Annotated[
        Path | None, typer.Option("--update", help="Merge better plans and bounds into this file of best plans.")
    ] = None,
) -> None:
    """Every planner on a fixed suite of situations, beside the best plans known.

    Example: marsupial bench planners --engine anytime --instance 'rooms-*' --budget 1
    """
    from marsupial.bench.planner_report import table
    from marsupial.cli.planner_bench import Selection, rows_of_bench
    from marsupial.cli.tables import print_text

    chosen = Selection.of(engines or (), instances or (), budgets or ())
    print_text(table(rows_of_bench(chosen, json=json, update=update), chosen.absent) + "\n")


@bench.command()
def service(
    kills: Annotated[int, typer.Option(min=0, help="Processes killed at random moments; 0 leaves a part out.")] = 1000,
    hostile: Annotated[int, typer.Option(min=0, help="Runs of planners that misbehave.")] = 200,
    clients: Annotated[int, typer.Option(min=0, help="Clients at once, and streams open at the end.")] = 50,
    posts: Annotated[int, typer.Option(min=0, help="Jobs whose answers are timed while 100 wait.")] = 500,
    plans: Annotated[int, typer.Option(min=0, help="Jobs whose first plans are timed.")] = 100,
    fuzz_minutes: Annotated[float, typer.Option(min=0, help="Minutes of Schemathesis, if it is installed.")] = 15.0,
    seed: Annotated[int, typer.Option(min=0, help="Draws the moments of kills, and what is fuzzed.")] = 1,
    quick: Annotated[bool, typer.Option("--quick", help="A little of everything but fuzzing.")] = False,
    json: Annotated[Path | None, typer.Option("--json", help="Write a row per requirement there.")] = None,
) -> None:
    """Servers on trial: killed, given hostile planners, timed, ended, fuzzed.

    Exits with 1 if a requirement is missed.

    Example: marsupial bench service --quick
    """
    from marsupial.cli.serve import check_extra
    from marsupial.cli.service_bench import run_trial

    check_extra()
    from services.trial.run import QUICK, Extent

    wanted = Extent(
        kills=kills,
        hostile=hostile,
        clients=clients,
        posts=posts,
        plans=plans,
        fuzz_minutes=fuzz_minutes,
        seed=seed,
    )
    if not run_trial(QUICK if quick else wanted, json):
        raise typer.Exit(1)
