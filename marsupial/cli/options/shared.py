"""Options that several commands share, and help that lists the strategies, found only when it is printed."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperOption

from marsupial.cli.display.messages import Volume, set_volume, volume
from marsupial.cli.options import completing
from marsupial.errors import EngineUnavailable, UsageError


def _chooses(wanted: Volume) -> Callable[[bool], None]:
    def choose(asked: bool) -> None:
        if not asked:
            return
        # The callback of the second option finds the volume that the first one has set.
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
    # Defaults and environment variables have other sources.
    return [
        parameter.human_readable_name if parameter.param_type_name == "argument" else max(parameter.opts, key=len)
        for parameter in context.command.params
        if parameter.name not in besides
        and (source := context.get_parameter_source(str(parameter.name))) is not None
        and source.name == "COMMANDLINE"
    ]


def check_extra(what: str, extra: str, *modules: str) -> None:
    """Raise an error that names what to install if libraries of an optional part are missing."""
    try:
        for module in modules:
            import_module(module)
    except ImportError as error:
        raise EngineUnavailable(f"{what} needs {error.name}: pip install 'marsupial[{extra}]'") from error


def scenario_argument(help: str, **more: Any) -> Any:
    return typer.Argument(autocompletion=completing.scenario_or_file, help=help, **more)


def planner_option(help: str) -> Any:
    return typer.Option("--planner", "-p", autocompletion=completing.planner, help=help)


Planner = Annotated[str | None, planner_option("Planner, or 'cmd:COMMAND {domain} {problem}' [default: auto].")]
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
    typer.Option(metavar="ADDRESS", help="Run on this Ray cluster instead: HOST:PORT, ray://HOST:PORT, auto or local."),
]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="Rerun missions that ended with status error or crashed.")
]

COMPARE_STEPS = 8  # default steps per planning call of a comparison
STRATEGIES = "{strategies}"  # placeholder for the names of all strategies in the help of an option


class KeepsInput(TyperCommand):
    """A command that refuses to overwrite a file it was given to read."""

    def invoke(self, ctx: Any) -> Any:
        read: list[Path] = []
        written: dict[str, Path] = {}
        for parameter in self.params:
            value = ctx.params.get(str(parameter.name))
            if parameter.param_type_name == "argument":
                read += [Path(each) for each in (value if isinstance(value, list | tuple) else (value,)) if each]
            elif value is not None and parameter.type.name == "path":
                written[max(parameter.opts, key=len)] = Path(value)
        for option, path in written.items():
            if path.is_file() and any(file.is_file() and path.samefile(file) for file in read):
                raise UsageError(f"{option} {path}: would write over a file that the command reads")
        return super().invoke(ctx)


class LateHelp(KeepsInput):
    """A command whose options may have the placeholder `STRATEGIES` in their help."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        self._complete_help()
        super().format_options(ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        self._complete_help()
        return super().shell_complete(ctx, incomplete)

    def _complete_help(self) -> None:
        # Only now, when help is printed: finding the strategies means looking through installed packages.
        from marsupial.strategies.clairvoyant import CLAIRVOYANT
        from marsupial.strategies.registry import strategy_names

        names = f"{', '.join(strategy_names())}, or {CLAIRVOYANT}, which knows the map beforehand"
        for option in self.params:
            if isinstance(option, TyperOption) and option.help is not None:
                option.help = option.help.replace(STRATEGIES, names)
