"""Judge a mission by its log, its summary and the scenario, using only the rules of the documentation.

The oracle imports nothing of the product. An account follows the events (`account`), and every rule (`rules`) is asked
about each event before it is applied, in the order below: a robot's command first, then what comes of it, then the end.
To add a rule, write it in a file of its own, and add it to a list.

Where the documentation leaves room (a line of sight through a corner, rounding), the rules accept both readings.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence

from benchmarks.storm.account import Account, ReportedMission
from benchmarks.storm.ground import Document
from benchmarks.storm.rules import (
    batteries,
    contact,
    coverage,
    docking,
    failures,
    lines,
    losses,
    motion,
    plans,
    progress,
    remaining,
    reported_map,
    sensing,
    status,
    totals,
    zones,
)

OracleRule = Callable[[Account, Document], Iterator[str]]

ALWAYS: tuple[OracleRule, ...] = (
    lines.lines_are_in_order,
    plans.plans_are_valid,
    docking.actions_begin_rightly,
    docking.rovers_have_places,
    motion.drives_begin_rightly,
    zones.zones_hold,
    sensing.what_is_seen_is_true,
    totals.counts_are_those_of_the_log,
    totals.metres_and_energy_are_true,
    status.status_is_true,
)
"""The rules of all missions."""

SIMULATED: tuple[OracleRule, ...] = (
    batteries.charges_are_true,
    zones.targets_lead_into_the_area,
    contact.contact_is_by_range,
    motion.drives_are_true,
    motion.robots_stand_where_they_fit,
    docking.actions_end_rightly,
    failures.failures_have_causes,
    losses.losses_have_causes,
    sensing.what_is_seen_is_in_range,
    sensing.what_is_in_plain_view_is_seen,
    coverage.areas_are_those_of_the_map,
    coverage.all_that_is_reachable_is_known,
    remaining.remaining_frontiers_are_frontiers,
)
"""Those of missions whose robots know a true map: their logs have all that robots do."""

REPORTED: tuple[OracleRule, ...] = (
    motion.drives_are_over_known_cells,
    losses.losses_on_reported_maps_have_causes,
    reported_map.last_map_is_known,
    remaining.what_is_left_is_named,
    remaining.what_is_given_up_was_not_seen,
)
"""Those of missions whose robots report their own map: it may be wrong and late, and has a frame that grows."""


def judge_simulated(scenario: Document, log: Sequence[str], summary: Document) -> list[str]:
    """Return what is wrong with a mission in the simulator; empty if all rules hold."""
    return _judge(scenario, log, (*ALWAYS, *SIMULATED), summary=summary)


def judge_reported(scenario: Document, mission: ReportedMission) -> list[str]:
    """Return what is wrong with a mission whose robots reported their own map."""
    return _judge(scenario, mission.lines, (*ALWAYS, *REPORTED, progress.StormProgress()), reported=mission)


def _judge(
    scenario: Document,
    log: Sequence[str],
    rules: Sequence[OracleRule],
    summary: Document | None = None,
    reported: ReportedMission | None = None,
) -> list[str]:
    if len(log) < 2 or [json.loads(log[k])["event"] for k in (0, -1)] != ["mission", "ended"]:
        return ["the log does not run from `mission` to `ended`"]
    account = Account(scenario, log[0], summary, reported)
    findings: list[str] = []
    for k, line in enumerate(log):
        event = account.read(line) if k else account.first
        account.pass_to(event["t_ms"])
        for rule in rules:
            findings += (f"{event['event']} at {event['t_ms']} ms: {what}" for what in rule(account, event))
        account.apply(event)
    return findings
