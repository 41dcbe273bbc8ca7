"""Two missions side by side, and the replay page of one; the work of `marsupial demo`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from marsupial.bench.simulate import MissionSummary
from marsupial.cli.display.report import total_m
from marsupial.cli.display.tables import clock, print_table
from marsupial.cli.missions import NO_PLANNER
from marsupial.cli.outputs import write_file
from marsupial.formats.missionlog import read_log
from marsupial.replay.page import replay_page


def print_comparison(summaries: Sequence[MissionSummary]) -> None:
    """Print a table with a column for each mission, and what the first saves against the last."""
    heads = ["", *(_name(summary) for summary in summaries), "saved"]
    print_table(heads, [*_amounts(summaries), *_counts(summaries)], right=range(1, len(heads)))


def write_replay(log: Path, page: Path) -> None:
    """Write the replay page of a mission log."""
    write_file(page, replay_page(read_log(log).events))


def _name(summary: MissionSummary) -> str:
    return summary.strategy if summary.planner == NO_PLANNER else f"{summary.strategy} ({summary.planner})"


def _amounts(summaries: Sequence[MissionSummary]) -> list[list[str]]:
    """Return the rows of which less is better, each with its saving."""
    ends = [summary.ended for summary in summaries]
    explored = [None if end.exploration_ms is None else end.exploration_ms / 1000 for end in ends]
    lasted = [end.t_ms / 1000 for end in ends]
    driven = [total_m(summary) for summary in summaries]
    energy = [sum(joules for _, joules in end.energy_j) / 1000 for end in ends]
    return [
        ["exploration time", *("never done" if t is None else clock(t) for t in explored), _saved(explored)],
        ["mission time", *(clock(t) for t in lasted), _saved(lasted)],
        ["distance", *(f"{metres:.1f} m" for metres in driven), _saved(driven)],
        ["energy", *(f"{kilojoules:.1f} kJ" for kilojoules in energy), _saved(energy)],
    ]


def _counts(summaries: Sequence[MissionSummary]) -> list[list[str]]:
    columns = [
        {
            "status": str(summary.ended.status),
            "coverage": f"{summary.ended.coverage:.1%}",
            "quality Q": f"{summary.quality:.3f} m2/m",
            "deployments": str(summary.ended.deployments),
            "retrievals": str(summary.ended.retrievals),
            "replans": str(summary.ended.replans),
            "invalid plans": str(summary.ended.plans_invalid),
            "planning, median": f"{summary.planning.median:.3f} s",
            "planning, total": f"{summary.planning.total:.1f} s",
        }
        for summary in summaries
    ]
    return [[name, *(column[name] for column in columns), ""] for name in columns[0]]


def _saved(values: Sequence[float | None]) -> str:
    first, last = values[0], values[-1]
    return "" if len(values) == 1 or first is None or not last else f"{1 - first / last:.1%}"
