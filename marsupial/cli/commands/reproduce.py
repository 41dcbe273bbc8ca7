"""`marsupial reproduce`: the experiment of a paper, its figures, and a verdict on each of its statements."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.options import completing, shared
from marsupial.model.bounds import COMPARE_STEPS


def reproduce(
    paper: Annotated[
        str,
        typer.Argument(
            metavar="PAPER", autocompletion=completing.paper, help="Paper: wurm2010, wurm2008, alkhawaldah or mei."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Output folder; resumes a comparison found in it.")],
    runs: Annotated[
        int | None, typer.Option(callback=shared.within(1, 100_000), help="Missions per case [default: see above].")
    ] = None,
    planner: Annotated[
        str | None, shared.planner_option("Planner for the temporal strategy [default: anytime].")
    ] = None,
    steps: Annotated[int, typer.Option(callback=shared.within(1), help="Steps per planning call.")] = COMPARE_STEPS,
    maps: Annotated[
        Path | None, typer.Option(help="Folder of real building maps for wurm2008 [default: ../shared/maps].")
    ] = None,
    interference: shared.KeepApart = False,
    workers: shared.Workers = None,
    ray: shared.RayAddress = None,
    retry_failed: shared.RetryFailed = False,
    quiet: shared.Quiet = False,
    verbose: shared.Verbose = False,
) -> None:
    """Run the experiments of a paper.

    Redraws its tables and figures with our data and gives a verdict on each of its claims.

    wurm2010: office and maze, 1-6 carriers with 1-3 rovers each, 30 runs, temporal planning and the paper's
    own method against the heuristic.

    wurm2008: two real offices, 2-6 and 2-8 robots, 6 runs, segments of the map against the closest frontier.

    alkhawaldah: two robots in worlds of cells with 0-40 obstacles, 40 runs, two bidding functions; sweeps of weights.

    mei: one robot on floor plans and among random obstacles, 10 runs, energy and distance; energy-aware routes.

    Further experiments: wurm2008-clutter, with clutter on the second map; alkhawaldah-triples, a sweep of three
    weights. Parts by themselves: alkhawaldah-weights, mei-corner.

    Example: marsupial reproduce wurm2010 --out wurm2010
    """
    from marsupial.errors import UsageError
    from marsupial.papers import PAPERS, PARTS, experiment
    from marsupial.wording import unknown_name

    whole = experiment(paper)
    if whole is None:
        raise UsageError(unknown_name("paper", paper, [*PAPERS, *PARTS]))
    from marsupial.bench.suite.maps import PLANNER, REAL_FOLDER
    from marsupial.cli.work import comparing
    from marsupial.cli.work.missions import changed
    from marsupial.model.planning import Budget
    from marsupial.papers.wurm2008 import experiment as wurm2008
    from marsupial.planning.engines import mission_engine

    if maps is not None and paper not in (wurm2008.NAME, wurm2008.CLUTTER):
        raise UsageError(f"--maps: {paper} is carried out on maps of its own; only {wurm2008.NAME} takes others")
    budget = Budget(steps=steps)
    planner = planner or PLANNER
    mission_engine(planner, budget)  # raises early if it can't be used
    parts = {folder: found for folder, name in whole.parts.items() if (found := experiment(name)) is not None}
    for folder, part in {"": whole, **parts}.items():
        # --runs is for the experiment itself: its parts may be single missions, as in the paper.
        asked = runs if part is whole else None
        count = asked or part.runs
        comparison = part.comparison(runs=count, planner=planner, budget=budget, maps=maps or REAL_FOLDER)
        cases = {case: changed(one, interference=interference) for case, one in comparison.scenarios.items()}
        comparison = replace(comparison, scenarios=cases)
        comparing.carry_out(comparison, out / folder, workers=workers, ray=ray, retry_failed=retry_failed)
