"""`marsupial bench`: all planners on a fixed suite; in a checkout also timings of marsupial itself."""

from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.display.help import PlainProgram
from marsupial.cli.options import completing
from marsupial.cli.options.shared import Quiet
from marsupial.errors import UsageError

bench = PlainProgram(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Compare planners on a fixed suite; time marsupial.\n\nExample: marsupial bench planners",
)


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
    """Run planners on a fixed suite of situations and compare with the best known plans.

    Example: marsupial bench planners --engine anytime --instance 'rooms-*'
    """
    from marsupial.bench.planner_report import table
    from marsupial.cli.display.tables import print_report
    from marsupial.cli.work.planner_bench import rows_of_bench

    print_report(table(*rows_of_bench(engines or (), instances or (), budgets or (), json=json, update=update)))


def _of_checkout(context: typer.Context) -> None:
    """Run the program of this name from `benchmarks`, which is not in the wheel."""
    name = context.info_name
    try:
        program = import_module(f"benchmarks.speed.{name}")
    except ModuleNotFoundError as error:
        raise UsageError(f"bench {name}: only in a checkout, as `python -m benchmarks {name}`") from error
    raise typer.Exit(program.main(context.args))


for _name in ("paths", "sim"):
    bench.command(
        _name,
        help=f"In a checkout: the same as `python -m benchmarks {_name}`.",
        add_help_option=False,
        context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
    )(_of_checkout)
