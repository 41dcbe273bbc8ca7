"""The trial's command: ``python -m trial``, run in the folder ``tests``."""

from __future__ import annotations

import json as json_text
import os
from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.display.messages import say
from marsupial.cli.display.tables import print_text
from marsupial.cli.outputs import write_file
from trial.parts import FULL, QUICK, Extent, Stores, kill_rows, trial
from trial.rows import Judgement, table


def command(
    kills: Annotated[
        int, typer.Option(min=0, help="Processes killed at random moments; 0 leaves a part out.")
    ] = FULL.kills,
    hostile: Annotated[int, typer.Option(min=0, help="Runs of planners that misbehave.")] = FULL.hostile,
    clients: Annotated[int, typer.Option(min=0, help="Clients at once, and streams open at the end.")] = FULL.clients,
    posts: Annotated[int, typer.Option(min=0, help="Jobs whose answers are timed while 100 wait.")] = FULL.posts,
    plans: Annotated[int, typer.Option(min=0, help="Jobs whose first plans are timed.")] = FULL.plans,
    half_open: Annotated[
        int, typer.Option(min=0, help="Connections that never ask; small requests that ask for much come with them.")
    ] = FULL.half_open,
    load_seconds: Annotated[
        float, typer.Option(min=0, help="Seconds of each load of reports and missions.")
    ] = FULL.load_seconds,
    fair_jobs: Annotated[int, typer.Option(min=0, help="Jobs timed while another key floods.")] = FULL.fair_jobs,
    stored: Annotated[int, typer.Option(min=0, help="Reports of which nearly all are removed.")] = FULL.stored,
    pages: Annotated[int, typer.Option(min=0, help="Plans timed until a page in a browser shows them.")] = FULL.pages,
    fuzz_minutes: Annotated[
        float, typer.Option(min=0, help="Minutes of Schemathesis, if it is installed.")
    ] = FULL.fuzz_minutes,
    seed: Annotated[int, typer.Option(min=0, help="Draws the moments of kills, and what is fuzzed.")] = FULL.seed,
    quick: Annotated[bool, typer.Option("--quick", help="A little of everything but fuzzing.")] = False,
    store: Annotated[
        Stores | None,
        typer.Option(help="Only kill: on SQLite, on PostgreSQL with two servers (and it), half of the kills on each."),
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", help="Write a row per requirement there.")] = None,
) -> None:
    """Servers on trial: killed, given hostile planners, timed, ended, fuzzed.

    Exits with 1 if a requirement is missed.

    Example: python -m trial --quick
    """
    wanted = Extent(
        kills=kills,
        hostile=hostile,
        clients=clients,
        posts=posts,
        plans=plans,
        half_open=half_open,
        load_seconds=load_seconds,
        fair_jobs=fair_jobs,
        stored=stored,
        pages=pages,
        fuzz_minutes=fuzz_minutes,
        seed=seed,
    )
    rows = []
    before = os.getloadavg()[0]
    found = trial(QUICK if quick else wanted, say) if store is None else kill_rows(kills, seed, store, say)
    for row in found:
        rows.append(row)
        if json is not None:
            write_file(json, json_text.dumps([one.document() for one in rows], indent=1) + "\n")
    load = f"{os.cpu_count()} cores; load {before:.1f} before, {os.getloadavg()[0]:.1f} after, with the trial's own"
    print_text(f"{table(rows)}\n{load}\n")
    if any(row.judgement is Judgement.MISSED for row in rows):
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(command)
