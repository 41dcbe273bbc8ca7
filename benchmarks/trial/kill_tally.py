"""Counts of what was killed in a trial, and its final report."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field

from benchmarks.trial.client_records import ClientRecords, Findings
from benchmarks.trial.rows import Judgement, TrialRow, none_of, times
from benchmarks.trial.trial_server import kill_orphans, orphans

DEPTHS = {1: "launcher", 2: "supervisor", 3: "worker"}
"""The kind of process at each depth below a server; a worker runs a job or a mission."""

SHARES = (1, 3, 5)
SERVER, COMMITTING, DATABASE = "server", "server at a commit", "database"
_GONE_S = 5.0


@dataclass(slots=True)
class KillTally:
    """Kills by victim, processes left behind, and how long the last one stayed after its server, in s.

    Attributes
    ----------
    failed, refused
        Servers that ended by themselves, and those that did so at their start for lack of a database.
    second_servers, second_servers_admitted
        Servers that tried to open another one's folder, and those that succeeded.
    errors, tracebacks
        Numbers of such lines in the servers' logs.
    """

    victims: Counter[str] = field(default_factory=Counter)
    failed: int = 0
    refused: int = 0
    second_servers: int = 0
    second_servers_admitted: int = 0
    orphans: int = 0
    gone_s: list[float] = field(default_factory=list)
    errors: int = 0
    tracebacks: Counter[str] = field(default_factory=Counter)

    @property
    def servers(self) -> int:
        """Number of servers killed."""
        return self.victims[SERVER] + self.victims[COMMITTING]

    def measure_orphans(self, keep: Collection[int] = ()) -> None:
        """Measure how long processes of a killed server stay; those in `keep` may stay."""
        begun = time.monotonic()
        left = orphans(_GONE_S, keep)
        self.gone_s.append(time.monotonic() - begun)
        self.orphans += len(left)
        if left:
            kill_orphans(keep)

    def read_log(self, text: str) -> None:
        """Count errors in the servers' log."""
        for line in text.splitlines():
            if line.startswith('{"at"'):
                try:
                    record = json.loads(line)
                except ValueError:  # cut off by a kill
                    continue
                self.errors += record["level"] in ("error", "critical")
                if "traceback" in record:
                    self.tracebacks[f"{record['message']}: {record['traceback'].splitlines()[-1][:80]}"] += 1
            elif line.startswith("Traceback"):
                self.tracebacks["bare"] += 1


def report(part: str, tally: KillTally, records: ClientRecords, found: Findings) -> list[TrialRow]:
    """Return rows of failures that must not have happened, and of events that did."""
    of = f" of {len(records.jobs)}"
    plans = f" of {found.plans} plans"
    streams = f" of {len(records.streams)}, resumed {records.resumed['in all']} times"
    if tally.victims[DATABASE]:
        streams += f", {records.resumed['elsewhere']} of that on another server"
    kinds = ", ".join(f"{count} x {victim}" for victim, count in tally.victims.most_common())
    outcomes = ", ".join(f"{word} {count}" for word, count in found.outcomes.most_common())
    figure = f"{tally.victims.total()}: {kinds}"
    return [
        TrialRow(part=part, requirement="killed at random moments", figure=figure, values=dict(tally.victims)),
        none_of(part, "acknowledged jobs lost", found.lost, of),
        none_of(part, "acknowledged jobs that never end", found.unfinished, of),
        none_of(part, "jobs that ended more than once", found.ended_again, of),
        none_of(part, "requests with one key that made two jobs", found.made_twice, of),
        none_of(part, "jobs whose events are not in order", found.bad_events, of),
        none_of(part, "improvements that clients were told of, lost", found.plans_lost, f" of {len(records.plans)}"),
        none_of(part, "revisions the checker refuses", found.bad_plans, plans),
        none_of(part, "jobs with a revision that is not better", found.not_better, of),
        none_of(part, "resumed streams unlike an uninterrupted one", found.streams_differ, streams),
        none_of(part, "requests answered as they should not be", records.odd.total(), _words(records.odd)),
        none_of(part, "servers that ended by themselves", tally.failed, f" of {tally.servers}"),
        none_of(part, "processes left 5 s after their server", tally.orphans),
        none_of(part, "errors in servers that nobody had foreseen", tally.tracebacks.total(), _words(tally.tracebacks)),
        times(part, "last process gone after its server", tally.gone_s),
        TrialRow(
            part=part, requirement="how jobs ended", figure=outcomes, judgement=Judgement.NOTED, values=found.outcomes
        ),
    ]


def _words(counts: Counter[str]) -> str:
    return f" ({', '.join(f'{count} {word}' for word, count in counts.most_common())})" if counts else ""
