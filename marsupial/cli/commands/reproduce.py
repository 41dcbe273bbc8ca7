"""`marsupial reproduce`: the experiment of a paper, its figures, and a verdict on each of its statements."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.options import COMPARE_STEPS, RayAddress, RetryFailed, Workers


def reproduce(
    paper: Annotated[str, typer.Argument(help="Which paper: wurm2010.")],
    out: Annotated[Path, typer.Option(help="Folder to write to; a comparison in it is resumed.")],
    runs: Annotated[int | None, typer.Option(min=1, max=100_000, help="Missions for each case [default: 30].")] = None,
    planner: Annotated[
        str | None, typer.Option("--planner", "-p", help="Planner of the temporal strategy [default: anytime].")
    ] = None,
    steps: Annotated[int, typer.Option(min=1, help="Steps for each planning.")] = COMPARE_STEPS,
    workers: Workers = None,
    ray: RayAddress = None,
    retry_failed: RetryFailed = False,
) -> None:
    """Carry out the experiment of a paper.

    Its figures are drawn with our data, and each of its statements gets a verdict.

    wurm2010: office and maze, 1-6 carriers with 1-3 rovers each, 30 runs, temporal planning against the heuristic.

    Example: marsupial reproduce wurm2010 --out wurm2010
    """
    from marsupial.bench.compare.papers import PAPERS
    from marsupial.cli import comparing
    from marsupial.errors import UsageError
    from marsupial.model.planning import Budget
    from marsupial.planning.engines import mission_engine

    if paper not in PAPERS:
        raise UsageError(f"unknown paper {paper!r}; there are {', '.join(sorted(PAPERS))}")
    budget = Budget(steps=steps)
    experiment = PAPERS[paper]
    planner = planner or experiment.planner
    mission_engine(planner, budget)  # refuses what can't be used before anything is started
    comparison = experiment.comparison(runs or experiment.runs, planner, budget)
    comparing.carry_out(comparison, out, workers=workers, ray=ray, retry_failed=retry_failed)
