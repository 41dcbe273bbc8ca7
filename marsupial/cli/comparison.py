"""Two missions side by side, and the replay page of one; the work of `marsupial demo`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from marsupial.cli.display.tables import print_table
from marsupial.cli.outputs import write_file
from marsupial.formats.missionlog import read_log
from marsupial.library.metrics import METRICS, Summary
from marsupial.model.planning import NO_PLANNER
from marsupial.replay.page import replay_page

SAVED = ("exploration_time_s", "mission_time_s", "distance_m", "energy_j")
"""Metrics of which less is better, each with its saving."""

OTHERS = (
    "coverage", "quality", "deployments", "retrievals", "replans", "plans_invalid", "planning_s.median",
    "planning_s.total",
)  # fmt: skip


def print_comparison(summaries: Sequence[Summary]) -> None:
    """Print a table with a column for each mission, and what the first saves against the last."""
    heads = ["", *(_name(summary) for summary in summaries), "saved"]
    rows = [_row(key, summaries, _saved([METRICS[key].of(summary) for summary in summaries])) for key in SAVED]
    rows.append(["status", *(str(summary.status) for summary in summaries), ""])
    rows += [_row(key, summaries) for key in OTHERS]
    print_table(heads, rows, right=range(1, len(heads)))


def write_replay(log: Path, page: Path) -> None:
    """Write the replay page of a mission log."""
    write_file(page, replay_page(read_log(log).events))


def _name(summary: Summary) -> str:
    return summary.strategy if summary.planner == NO_PLANNER else f"{summary.strategy} ({summary.planner})"


def _row(key: str, summaries: Sequence[Summary], saved: str = "") -> list[str]:
    return [METRICS[key].title, *(METRICS[key].shown(summary) for summary in summaries), saved]


def _saved(values: Sequence[float | None]) -> str:
    first, last = values[0], values[-1]
    return "" if len(values) == 1 or first is None or not last else f"{1 - first / last:.1%}"
