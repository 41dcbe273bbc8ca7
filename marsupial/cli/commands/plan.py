"""`marsupial plan`: one situation, improving plans."""

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.options.shared import Json, Planner, Quiet, keep_inputs

DEFAULT_BUDGET_S = 10.0


def plan(
    situation: Annotated[
        Path, typer.Argument(metavar="SITUATION", help="A situation (.json) or a problem of the domain (.pddl).")
    ],
    planner: Planner = None,
    budget: Annotated[float | None, typer.Option(help="Seconds [default: 10].")] = None,
    steps: Annotated[int | None, typer.Option(help="Steps instead of seconds, reproducible.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the best plan to this file.")] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plan for one situation, printing better and better plans.

    Prints a line on stderr for each better plan, and the best plan in IPC format on stdout or to a file. The last
    line rates it: its makespan is optimal, or a lower bound is given with the gap, as a share of the makespan. Both
    are exact to 1 ms, with 1 ms between the actions of a robot.

    Example: marsupial export lobby -o moment

    marsupial plan moment/situation.json --budget 5 -o plan.txt
    """
    from marsupial.cli.display.tables import print_json, print_text
    from marsupial.formats.files import write_file
    from marsupial.library.choices import DEFAULT_PLANNER, budget_of
    from marsupial.library.situations import situation_of
    from marsupial.planning.engines import engine

    keep_inputs(situation, output=output)
    limit = budget_of(budget, steps, default_s=DEFAULT_BUDGET_S)
    asked = planner or DEFAULT_PLANNER
    wanted = situation_of(situation)
    engine(asked)  # raises for an unknown name before the imports below, which take a second
    from marsupial.cli.work.planning import exit_code, search, search_json
    from marsupial.formats.pddl.plantext import write_plan_text

    found = search(wanted, asked, limit)
    text = "" if found.best is None else write_plan_text(found.best, found.situation)
    if output is not None and text:
        write_file(output, text)
    if json:
        print_json(
            {**search_json(found, asked), "plan": text or None, "output": str(output) if output and text else None}
        )
    elif output is None:
        print_text(text)
    raise typer.Exit(exit_code(found))
