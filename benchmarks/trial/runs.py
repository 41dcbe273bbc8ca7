"""The trial's command: run all or the selected parts, and print a table of the findings."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from benchmarks.trial.parts import FULL, QUICK, Stores, TrialExtent, kill_rows, trial
from benchmarks.trial.rows import Judgement, table
from marsupial.cli.display.messages import say
from marsupial.cli.display.tables import print_text
from marsupial.formats.files import write_file

HELP = {
    "kills": "processes killed at random moments",
    "hostile": "runs of planners that misbehave",
    "clients": "clients at once, and streams open at the end",
    "posts": "jobs whose answers are timed while 100 wait",
    "plans": "jobs whose first plans are timed",
    "half_open": "connections that never ask; small requests that ask for much come with them",
    "load_seconds": "seconds of each load of reports and missions",
    "fair_jobs": "jobs timed while another key floods",
    "stored": "reports of which nearly all are removed",
    "pages": "plans timed until a page in a browser shows them",
    "proxied": "missions of a fleet with faults behind a proxy that breaks requests",
    "fuzz_minutes": "minutes of Schemathesis, if it is installed",
    "seed": "draws the moments of kills, and what is fuzzed",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code: 1 if a requirement is not met."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks trial",
        description="Servers on trial: killed, given hostile planners, timed, ended, fuzzed.",
        epilog="0 leaves a part out.",
    )
    for field in fields(TrialExtent):
        default = getattr(FULL, field.name)
        option = "--" + field.name.replace("_", "-")
        parser.add_argument(option, type=type(default), default=default, help=f"{HELP[field.name]} (%(default)s)")
    parser.add_argument("--quick", action="store_true", help="a little of everything but fuzzing")
    parser.add_argument(
        "--store",
        type=Stores,
        choices=list(Stores),
        help="only kill: on SQLite, on PostgreSQL with two servers (and it), half of the kills on each",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write a row per requirement there")
    chosen = parser.parse_args(arguments)
    wanted = (
        QUICK
        if chosen.quick
        else TrialExtent(**{field.name: getattr(chosen, field.name) for field in fields(TrialExtent)})
    )
    rows = []
    before = os.getloadavg()[0]
    found = trial(wanted, say) if chosen.store is None else kill_rows(chosen.kills, chosen.seed, chosen.store, say)
    for row in found:
        rows.append(row)
        if chosen.json is not None:
            write_file(chosen.json, json.dumps([one.document() for one in rows], indent=1) + "\n")
    load = f"{os.cpu_count()} cores; load {before:.1f} before, {os.getloadavg()[0]:.1f} after, with the trial's own"
    print_text(f"{table(rows)}\n{load}\n")
    return 1 if any(row.judgement is Judgement.MISSED for row in rows) else 0
