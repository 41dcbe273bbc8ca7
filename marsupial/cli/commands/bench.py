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
    from marsupial.cli.display.tables import print_text

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
    from marsupial.cli.display.tables import print_text
    from marsupial.cli.planner_bench import Selection, rows_of_bench

    chosen = Selection.of(engines or (), instances or (), budgets or ())
    print_text(table(rows_of_bench(chosen, json=json, update=update), chosen.absent) + "\n")
