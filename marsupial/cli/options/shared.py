"""Options that several commands share, and checks of them."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from marsupial.cli.display.messages import Volume, set_volume, volume
from marsupial.cli.options import completing
from marsupial.errors import EngineUnavailable, UsageError
from marsupial.model.bounds import BOUNDS, MOST, Bound
from marsupial.strategies.infos import CLAIRVOYANT, OWN


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
    """Return the options given on the command line; `besides` are the names of parameters to leave out."""
    # Defaults and environment variables have other sources.
    return [
        f"--{name.replace('_', '-')}"
        for name in context.params
        if name not in besides
        and (source := context.get_parameter_source(name)) is not None
        and source.name == "COMMANDLINE"
    ]


def check_extra(what: str, extra: str, *modules: str) -> None:
    """Raise an error that names what to install if libraries of an optional part are missing."""
    try:
        for module in modules:
            import_module(module)
    except ImportError as error:
        raise EngineUnavailable(f"{what} needs {error.name}: pip install 'marsupial[{extra}]'") from error


def scenario_argument(help: str, metavar: str = "SCENARIO") -> Any:
    return typer.Argument(metavar=metavar, autocompletion=completing.scenario_or_file, help=help)


def within(least: float, most: float = MOST) -> Callable[[typer.CallbackParam, Any], Any]:
    """Return the callback of an option whose number has these bounds; it refuses others in plain words."""
    bound = Bound(least, most)

    def check(option: typer.CallbackParam, value: Any) -> Any:
        if value is not None and (fault := bound.fault(value)):
            raise UsageError(f"--{str(option.name).replace('_', '-')}: {fault}")
        return value

    return check


def planner_option(help: str) -> Any:
    return typer.Option("--planner", "-p", autocompletion=completing.planner, help=help)


Planner = Annotated[str | None, planner_option("Planner, or 'cmd:COMMAND {domain} {problem}' [default: auto].")]
Seed = Annotated[int | None, typer.Option(callback=within(0), help="Random seed of the start positions [default: 1].")]
PlanningBudget = Annotated[float | None, typer.Option(help="Seconds per planning call [default: 1].")]
RouteChoice = Annotated[
    str | None, typer.Option("--routes", help="shortest or energy (least energy) [default: the scenario's].")
]
KeepApart = Annotated[bool, typer.Option("--interference", help="Robots keep out of each other's footprints.")]
TimeLimit = Annotated[float | None, typer.Option(help="Stop a mission after this many simulated seconds.")]

_CELL = BOUNDS["resolution_m"]
ResolutionOption = Annotated[
    float | None,
    typer.Option(callback=within(_CELL.least, _CELL.most), help="Metres per cell, of an image or a MovingAI map."),
]


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
JsonList = Annotated[bool, typer.Option("--json", help="Print a JSON list.")]

Workers = Annotated[
    int | None, typer.Option(callback=within(1, 1024), help="Worker processes [default: one per core].")
]
RayAddress = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Run on this Ray cluster instead: HOST:PORT, ray://HOST:PORT, auto or local."),
]
RetryFailed = Annotated[
    bool, typer.Option("--retry-failed", help="Rerun missions that ended with status error or crashed.")
]

_NAMES = ", ".join(one.name for one in OWN)
STRATEGIES = f"{_NAMES}, {CLAIRVOYANT.name} (knows the map beforehand), one of an installed package, or FILE.py:CLASS"
"""The strategies in help. Finding those of packages takes 10 ms, a tenth of the start: `marsupial strategies` does."""


def keep_inputs(*read: str | Path, **written: Path | None) -> None:
    """Raise an error if one of the files to write, by the names of their options, is one of those to read."""
    inputs = [file for file in map(Path, read) if file.is_file()]
    for name, path in written.items():
        if path is not None and path.is_file() and any(path.samefile(file) for file in inputs):
            raise UsageError(f"--{name} {path}: would write over a file that the command reads")
