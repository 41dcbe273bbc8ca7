"""`marsupial run`: one mission."""

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.options import completing, shared
from marsupial.cli.process.exit_codes import MISSION_CODES


def run(
    scenario: Annotated[
        str,
        shared.scenario_argument("A built-in scenario, a scenario file, a nav2 map.yaml, a MovingAI .map or an image."),
    ],
    strategy: Annotated[
        str,
        typer.Option(
            "--strategy",
            "-s",
            autocompletion=completing.strategy,
            help=f"{shared.STRATEGIES}.",
            rich_help_panel="Planning",
        ),
    ] = "temporal",
    planner: shared.Planner = None,
    budget: shared.PlanningBudget = None,
    steps: Annotated[int | None, typer.Option(help="Steps per planning call instead, reproducible.")] = None,
    planning_time: Annotated[
        str | None, typer.Option(help="instant, or charged to the mission clock [default: the scenario's].")
    ] = None,
    server: Annotated[
        str | None, typer.Option(help="URL of a service that plans the mission; MARSUPIAL_KEY holds the API key.")
    ] = None,
    carriers: Annotated[
        int | None, typer.Option(help="Number of carriers.", rich_help_panel="Team and mission")
    ] = None,
    rovers: Annotated[int | None, typer.Option(help="Number of rovers per carrier.")] = None,
    seed: shared.Seed = None,
    resolution: shared.ResolutionOption = None,
    routes: shared.RouteChoice = None,
    interference: shared.KeepApart = False,
    time_limit: shared.TimeLimit = None,
    log: Annotated[
        Path | None, typer.Option(help="Write the mission log to this file.", rich_help_panel="Output")
    ] = None,
    json: shared.Json = False,
    quiet: shared.Quiet = False,
    verbose: shared.Verbose = False,
) -> None:
    """Run one mission.

    Example: marsupial run office --seed 2 --log office.jsonl
    """
    from marsupial.cli.work.missions import MissionRequest, carry_out

    shared.keep_inputs(scenario, log=log)
    request = MissionRequest(
        source=scenario,
        strategy=strategy,
        planner=planner,
        carriers=carriers,
        rovers=rovers,
        seed=seed,
        budget_s=budget,
        steps=steps,
        log=log,
        planning_time=planning_time,
        routes=routes,
        interference=interference,
        time_limit_s=time_limit,
        server=server,
        resolution_m=resolution,
    )
    summary, explored = carry_out(request)
    from marsupial.cli.display.report import print_summary
    from marsupial.cli.display.tables import print_json

    if json:
        print_json(summary.as_dict())
    else:
        print_summary(summary, explored.grid)
    raise typer.Exit(MISSION_CODES[summary.status])
