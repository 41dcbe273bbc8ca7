"""The work of `marsupial compare` and `marsupial reproduce`: run missions, write documents."""

from __future__ import annotations

import os
from pathlib import Path

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.conduct import MissionRunner, conduct
from marsupial.bench.compare.folder import read_curves, read_header, read_rows, read_timings
from marsupial.bench.compare.pairs import FOLDER, pair_pages, replays_in
from marsupial.bench.compare.plan import Comparison
from marsupial.bench.compare.pool import LocalPool
from marsupial.bench.compare.ray_pool import RayPool
from marsupial.bench.compare.report import documents
from marsupial.bench.compare.rows import CRASHED, ERROR
from marsupial.bench.compare.tables import GAINS, main_table
from marsupial.cli.display.compare_progress import compare_progress
from marsupial.cli.display.messages import say, warn
from marsupial.cli.display.tables import print_table
from marsupial.cli.process.interrupt import Interrupted
from marsupial.cluster.ray_cluster import cluster_at, usable
from marsupial.errors import UsageError
from marsupial.formats.files import make_folder, replace_file, writing
from marsupial.library.first_use import prepare_mission
from marsupial.papers import experiment
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import check_suits
from marsupial.strategies.registry import strategy as made


def _runner(comparison: Comparison, workers: int | None, ray: str | None) -> MissionRunner:
    """Return the runner: processes on this machine, by default one per core, or a Ray cluster."""
    if ray is not None:
        if workers is not None:
            raise UsageError("--workers can't be combined with --ray: a Ray cluster uses all its processors")
        return RayPool(comparison, usable(cluster_at(ray)))
    if workers is None:
        workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return LocalPool(comparison, workers)


def check_teams(comparison: Comparison) -> None:
    """Raise a `ScenarioError` if a contender can't lead the team of one of the scenarios."""
    for contender in comparison.contenders:
        if contender.strategy == CLAIRVOYANT:
            continue
        decider = made(contender.strategy, planner=contender.planner, budget=comparison.budget)
        for scenario in comparison.scenarios.values():
            check_suits(decider, [scenario.type_of(member).role for member in scenario.team])


def carry_out(comparison: Comparison, out: Path, *, workers: int | None, ray: str | None, retry_failed: bool) -> None:
    """Run the remaining missions of a comparison, with progress on stderr, and write its documents."""
    check_teams(comparison)
    runner = _runner(comparison, workers, ray)
    make_folder(out)
    scenario = next(iter(comparison.scenarios.values()))
    # otherwise every worker would compile the same code at the same time
    for contender in comparison.contenders:
        prepare_mission(scenario, contender.strategy, contender.planner, say)()  # compiled here, loaded by the workers
    drop = (ERROR, CRASHED) if retry_failed else ()
    try:
        with writing(out), compare_progress() as watch:
            conduct(comparison, runner, out, watch, drop=drop)
    except (Interrupted, KeyboardInterrupt):
        say(f"results so far are in {out}: the same command resumes, `marsupial compare --report {out}` shows them")
        raise
    if comparison.paper is None:
        _write_pairs(comparison, out)
    report(out)


def _outcome(out: Path) -> ComparisonOutcome:
    return ComparisonOutcome(read_header(out), read_rows(out), read_timings(out), read_curves(out))


def _write_pairs(comparison: Comparison, out: Path) -> None:
    outcome = _outcome(out)
    with writing(out):
        (out / FOLDER).mkdir(exist_ok=True)
        for name, data in pair_pages(comparison, outcome, out):
            replace_file(out / name, data)
        kept = {out / path for path in replays_in(out, outcome)}
        for file in set((out / FOLDER).glob("*.html")) - kept:
            file.unlink()


def report(out: Path) -> None:
    """Write the documents of the comparison in a folder, complete or not, and print the main table."""
    outcome = _outcome(out)
    say("writing tables and figures ...")
    with writing(out):
        (out / "figures").mkdir(exist_ok=True)
        stale = {*out.glob("checklist.md"), *out.glob("figures/*.svg"), *out.glob("figures/*.png")}
        for name, data in documents(outcome, experiment(str(outcome.header.get("paper"))), replays_in(out, outcome)):
            replace_file(out / name, data)
            stale.discard(out / name)
        for file in stale:  # from before the comparison grew: out of date now
            file.unlink()
    table = main_table(outcome)
    if table.rows:
        # a terminal has room for one interval and no more than two of the other metrics
        cells = [[row[i].text for i in (0, 1, 2, 3, 4, -1)] for row in table.rows]
        rows = [[*row[:3], *(text.partition(" [")[0] for text in row[3:])] for row in cells]
        print_table([*table.heads[:5], table.heads[-1]], rows, right=range(2, 6))
        say(f"{table.title}: {GAINS}")
    if missing := outcome.planned - len(outcome.rows):
        warn(f"{missing} of {outcome.planned} missions are missing")
    if failed := len(outcome.incomplete()):
        warn(f"{failed} of {len(outcome.rows)} missions are not complete and count in no mean")
    say(f"wrote {out / 'report.html'}")
