"""`marsupial demo`: a mission with temporal planning, the same with the baseline, and a replay of both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from marsupial.cli.display.messages import say
from marsupial.cli.options import completing
from marsupial.cli.options.shared import Quiet, Seed, Verbose
from marsupial.cli.process.exit_codes import MISSION_CODES

if TYPE_CHECKING:
    from marsupial.library.metrics import Summary

STEPS = 100  # steps per planning call without a budget: reproducible on every machine


def demo(
    out: Annotated[Path, typer.Option(help="Output folder.")] = Path("demo"),
    scenario: Annotated[
        str, typer.Option(autocompletion=completing.scenario_or_file, help="A scenario accepted by `marsupial run`.")
    ] = "office",
    seed: Seed = None,
    budget: Annotated[float | None, typer.Option(help=f"Seconds per planning call instead of {STEPS} steps.")] = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a mission beside the baseline, with a replay of both.

    2 carriers with 2 rovers each explore the office, once with the temporal planner and once with the heuristic
    baseline, from the same starts.

    Example: marsupial demo --out demo
    """
    from marsupial.cli.display.report import print_comparison
    from marsupial.cli.work.missions import MissionRequest, carry_out
    from marsupial.formats.files import make_folder, write_file
    from marsupial.formats.missionlog import read_log
    from marsupial.replay.page import replay_page

    make_folder(out)
    steps = STEPS if budget is None else None
    request = MissionRequest(source=scenario, seed=seed, carriers=2, rovers=2, budget_s=budget, steps=steps)
    summaries: list[Summary] = []
    logs = []
    # Both start from the same seed, so the missions differ in their strategy alone.
    baseline = replace(request, strategy="heuristic", budget_s=None, steps=None)  # asks no planner
    for asked in (request, baseline):
        log = out / f"{asked.strategy}.jsonl"
        summaries.append(carry_out(replace(asked, log=log), again=bool(summaries))[0])
        logs.append(log)
        if summaries[-1].status == "cancelled":
            break
    print_comparison(summaries)
    page = out / "replay.html"
    write_file(page, replay_page(*(read_log(log).events for log in logs)))
    for path in (*logs, page):
        say(f"wrote {path}")
    raise typer.Exit(max(MISSION_CODES[summary.status] for summary in summaries))
