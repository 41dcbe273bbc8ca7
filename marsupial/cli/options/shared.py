"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from marsupial.cli.display.messages import Volume, set_volume, volume
from marsupial.cli.options import completing
from marsupial.errors import UsageError


def _chooses(wanted: Volume) -> Callable[[bool], None]:
    def choose(asked: bool) -> None:
        if not asked:
            return
        if volume() not in (Volume.NORMAL, wanted):
            raise UsageError("--quiet and --verbose: only one of them")
        set_volume(wanted)

    return choose


Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", callback=_chooses(Volume.QUIET), expose_value=False, help="Print errors only."),
]
Verbose = Annotated[
    bool,
    typer.Option("--verbose", "-v", callback=_chooses(Volume.VERBOSE), expose_value=False, help="Print each step."),
]


def options_given(context: typer.Context, *besides: str) -> list[str]:
    """Return the options and arguments given on the command line, without the parameters `besides`."""
    return [
        parameter.human_readable_name if parameter.param_type_name == "argument" else max(parameter.opts, key=len)
        for parameter in context.command.params
        if parameter.name not in besides
        and (source := context.get_parameter_source(str(parameter.name))) is not None
        and source.name == "COMMANDLINE"
    ]


Planner = Annotated[
    str | None,
    typer.Option(
        "--planner",
        "-p",
        autocompletion=completing.planner,
        help="Planner, or 'cmd:COMMAND {domain} {problem}' [default: auto].",
    ),
]
Seed = Annotated[int | None, typer.Option(min=0, help="Random seed of the start positions [default: 1].")]
PlanningBudget = Annotated[float | None, typer.Option(help="Seconds per planning call [default: 1].")]
RouteChoice = Annotated[
    str | None, typer.Option("--routes", help="shortest or energy (least energy) [default: the scenario's].")
]
KeepApart = Annotated[bool, typer.Option("--interference", help="Robots keep out of each other's footprints.")]
TimeLimit = Annotated[float | None, typer.Option(help="Stop a mission after this many simulated seconds.")]

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
JsonList = Annotated[bool, typer.Option("--json", help="Print a JSON list.")]

Workers = Annotated[int | None, typer.Option(min=1, max=1024, help="Worker processes [default: one per core].")]
RayAddress = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run on this Ray cluster instead: HOST:PORT, ray://HOST:PORT, auto or local.",
    ),
]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="Rerun missions that ended with status error or crashed.")
]

COMPARE_STEPS = 8
"""Default steps per planning call of a comparison."""
