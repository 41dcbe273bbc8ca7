"""`marsupial bench`: the project's own benchmarks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli import completing
from marsupial.cli.options import COMPARE_STEPS, Quiet, options_given

bench = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Run a benchmark of marsupial itself.\n\nExample: marsupial bench paths",
)


Sizes = Annotated[
    list[int] | None,
    typer.Option("--size", min=64, max=8192, help="Cells of a map a side; may be repeated [default: 256 to 2048]."),
]
MapSeed = Annotated[int, typer.Option(min=0, help="Draws the maps.")]
Rows = Annotated[Path | None, typer.Option("--json", help="Write all rows there.")]


@bench.command()
def paths(
    sizes: Sizes = None,
    seed: MapSeed = 1,
    repeats: Annotated[int, typer.Option(min=1, help="How often each job is timed; the median counts.")] = 3,
    json: Rows = None,
    quiet: Quiet = False,
) -> None:
    """Path costs on grids beside searches in plain C and scipy's csgraph.

    Example: marsupial bench paths --size 1024 --size 4096
    """
    from marsupial.bench.paths import SIZES, bench_paths
    from marsupial.bench.paths_report import table, values
    from marsupial.cli.display.messages import say
    from marsupial.cli.own_benches import show

    result = bench_paths(sizes=sizes or SIZES, seed=seed, repeats=repeats, tell=say)
    show(table(result), values(result), json)


@bench.command()
def analysis(
    sizes: Annotated[
        list[int] | None,
        typer.Option(
            "--size", min=256, max=8192, help="Cells of a map a side; may be repeated [default: 256 to 2048]."
        ),
    ] = None,
    seed: MapSeed = 1,
    repeats: Annotated[int, typer.Option(min=1, help="How often something is revealed; the median counts.")] = 5,
    json: Rows = None,
    quiet: Quiet = False,
) -> None:
    """Map work after 1 % of a map was revealed, beside the same from scratch.

    Example: marsupial bench analysis --size 2048
    """
    from marsupial.bench.analysis import SIZES, bench_analysis, table, values
    from marsupial.cli.display.messages import say
    from marsupial.cli.own_benches import show

    rows = list(bench_analysis(sizes=sizes or SIZES, seed=seed, repeats=repeats, tell=say))
    show(table(rows), values(rows), json)


@bench.command()
def sim(
    context: typer.Context,
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(
            autocompletion=completing.scenario_or_file,
            metavar="[SCENARIO]...",
            help="As for `run` [default: all built-in ones].",
        ),
    ] = None,
    strategies: Annotated[
        list[str] | None,
        typer.Option(
            "--strategy",
            "-s",
            autocompletion=completing.strategy,
            help="May be repeated [default: heuristic and temporal].",
        ),
    ] = None,
    planner: Annotated[
        str,
        typer.Option("--planner", "-p", autocompletion=completing.planner, help="Engine of strategies that ask one."),
    ] = "anytime",
    steps: Annotated[int, typer.Option(min=1, help="Steps per planning call.")] = COMPARE_STEPS,
    sizes: Sizes = None,
    seed: Annotated[int, typer.Option(min=0, help="Draws the maps of views and the starts.")] = 1,
    repeats: Annotated[int, typer.Option(min=1, help="How often each is timed; the median counts.")] = 3,
    json: Rows = None,
    quiet: Quiet = False,
) -> None:
    """The simulator beside the time it simulates and sensing beside plain C; where the time of missions goes.

    Example: marsupial bench sim lobby --strategy heuristic
    """
    from marsupial.bench.sim import SIZES, table, values
    from marsupial.cli.display.messages import warn
    from marsupial.cli.own_benches import MissionChoice, missions_of_bench, show, sights_of_bench
    from marsupial.model.planning import Budget
    from marsupial.strategies.registry import asks_planner

    chosen = MissionChoice.of(scenarios or (), strategies or (), planner, Budget(steps=steps))
    for option in ("--planner", "--steps"):
        if option in options_given(context) and not any(map(asks_planner, chosen.strategies)):
            warn(f"{option} is ignored: none of the strategies asks a planner")
    sights = sights_of_bench(sizes or SIZES, seed, repeats)
    missions = missions_of_bench(chosen, seed, repeats)
    show(table(sights, missions), values(sights, missions), json)


@bench.command("first-use")
def first_use(
    commands: Annotated[
        list[str] | None, typer.Argument(metavar="[COMMAND]...", help="run, plan [default: both].")
    ] = None,
    repeats: Annotated[int, typer.Option(min=1, help="How often the second use is timed; the median counts.")] = 3,
    json: Rows = None,
    quiet: Quiet = False,
) -> None:
    """The first use of a command, with no compiled code kept, beside the ones after it.

    Example: marsupial bench first-use run
    """
    from marsupial.bench.first_use import bench_first_use, table, values
    from marsupial.cli.display.messages import say
    from marsupial.cli.own_benches import show

    rows = list(bench_first_use(commands or (), repeats=repeats, tell=say))
    show(table(rows), values(rows), json)


@bench.command()
def planners(
    engines: Annotated[
        list[str] | None,
        typer.Option("--engine", autocompletion=completing.planner, help="Only this planner; repeatable."),
    ] = None,
    instances: Annotated[
        list[str] | None,
        typer.Option("--instance", help="Only instances matching a pattern such as 'rooms-*'; repeatable."),
    ] = None,
    budgets: Annotated[
        list[float] | None, typer.Option("--budget", help="Seconds; repeatable [default: 0.1, 1 and 10].")
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", help="Write one row per run to this file.")] = None,
    update: Annotated[
        Path | None, typer.Option("--update", help="Merge better plans and bounds into this file of best known plans.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Every planner on a fixed suite of situations, beside the best plans known.

    Example: marsupial bench planners --engine anytime --instance 'rooms-*'
    """
    from marsupial.bench.planner_report import table
    from marsupial.cli.display.tables import print_report
    from marsupial.cli.planner_bench import Selection, rows_of_bench

    chosen = Selection.of(engines or (), instances or (), budgets or ())
    print_report(table(rows_of_bench(chosen, json=json, update=update), chosen.absent))
