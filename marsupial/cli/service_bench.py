"""The work of `marsupial bench service`: progress on stderr, one table, a file of rows."""

from __future__ import annotations

import json as json_text
import os
from pathlib import Path

from marsupial.cli.messages import say
from marsupial.cli.outputs import write_file
from marsupial.cli.tables import print_text
from services.trial.rows import Judgement, table
from services.trial.run import Extent, trial


def run_trial(extent: Extent, json: Path | None) -> bool:
    """Put servers on trial; return whether no requirement is missed."""
    rows = []
    before = os.getloadavg()[0]
    for row in trial(extent, say):
        rows.append(row)
        if json is not None:
            write_file(json, json_text.dumps([one.document() for one in rows], indent=1) + "\n")
    load = f"{os.cpu_count()} cores; load {before:.1f} before, {os.getloadavg()[0]:.1f} after, with the trial's own"
    print_text(f"{table(rows)}\n{load}\n")
    return all(row.judgement is not Judgement.MISSED for row in rows)
