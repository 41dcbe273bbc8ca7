"""`marsupial export`: the planning problem of one moment of a mission."""

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.display.messages import say
from marsupial.cli.options.shared import Quiet, scenario_argument, within


def export(
    source: Annotated[
        str, scenario_argument("A mission log, or a scenario accepted by `marsupial run`.", metavar="LOG|SCENARIO")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Output folder.")],
    at: Annotated[float, typer.Option(help="Simulated seconds since the start of the mission.")] = 0.0,
    carriers: Annotated[int | None, typer.Option(help="Number of carriers (scenarios only).")] = None,
    rovers: Annotated[int | None, typer.Option(help="Number of rovers per carrier (scenarios only).")] = None,
    seed: Annotated[
        int | None,
        typer.Option(callback=within(0), help="Random seed of the start positions (scenarios only) [default: 1]."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Write the planning problem of one moment.

    Writes situation.json, domain.pddl and problem.pddl, which any PDDL 2.1 planner can read.

    From a log: the moment of that mission; if a plan was made then, the problem it was made for. From a scenario: the
    same after running the mission up to that moment with the greedy planner.

    Example: marsupial export lobby --at 10 -o moment
    """
    from marsupial.cli.work.moments import moment_of
    from marsupial.formats.files import make_folder, write_file

    moment = moment_of(source, at, carriers=carriers, rovers=rovers, seed=seed)
    from marsupial.library.situations import situation_files

    files = situation_files(moment.survey().situation, f"{moment.mission.scenario}-{moment.t_ms}")
    make_folder(output)
    for name, text in files.items():
        write_file(output / name, text)
        say(f"wrote {output / name}")
