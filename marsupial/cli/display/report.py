"""A mission's summary, as one JSON object and as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from marsupial.bench.simulate import MissionSummary
from marsupial.cli.display.tables import clock, print_facts, print_text
from marsupial.model.mission import Remaining


def summary_json(summary: MissionSummary, log: Path | None) -> dict[str, Any]:
    """Return what `run --json` prints; metres, seconds and joules, every number finite."""
    ended = summary.ended
    return {
        "status": str(ended.status),
        "reason": ended.reason,
        "scenario": summary.scenario,
        "strategy": summary.strategy,
        "planner": summary.planner,
        "carriers": summary.carriers,
        "rovers": per_carrier(summary),
        "robots": summary.carriers + summary.rovers,
        "seed": summary.seed,
        "exploration_time_s": None if ended.exploration_ms is None else ended.exploration_ms / 1000,
        "mission_time_s": ended.t_ms / 1000,
        "coverage": ended.coverage,
        "explored_area_m2": ended.explored_area_m2,
        "reachable_area_m2": ended.reachable_area_m2,
        "distance_m": total_m(summary),
        "distance_m_per_robot": dict(ended.distance_m),
        "quality": summary.quality,
        "energy_j": round(sum(joules for _, joules in ended.energy_j), 3),
        "energy_j_per_robot": dict(ended.energy_j),
        "replans": ended.replans,
        "plans_valid": ended.plans_valid,
        "plans_invalid": ended.plans_invalid,
        "plans_refused": summary.refused,
        "planning_s": {
            "median": summary.planning.median,
            "p95": summary.planning.p95,
            "max": summary.planning.max,
            "total": summary.planning.total,
            "first_plan": summary.planning.first_plan,
        },
        "deployments": ended.deployments,
        "retrievals": ended.retrievals,
        "aboard": list(ended.aboard),
        "remaining": [_remaining(frontier) for frontier in ended.remaining],
        "log": None if log is None else str(log),
        "wall_s": summary.wall_s,
    }


def per_carrier(summary: MissionSummary) -> int | float:
    """Return the rovers per carrier, as `--rovers` counts them; a fraction where carriers bring different numbers."""
    if summary.carriers == 0:
        return summary.rovers
    share = summary.rovers / summary.carriers
    return int(share) if share.is_integer() else round(share, 3)


def print_summary(summary: MissionSummary, log: Path | None) -> None:
    """Print the summary of a mission and its stop report."""
    print_facts(facts(summary) + ([] if log is None else [("log", str(log))]))
    print_text("".join(f"{line}\n" for line in remaining_lines(summary)))


def facts(summary: MissionSummary) -> list[tuple[str, str]]:
    """Return what people want to know of a mission, by name."""
    ended, planning = summary.ended, summary.planning
    explored = "never done" if ended.exploration_ms is None else clock(ended.exploration_ms / 1000)
    return [
        ("status", f"{ended.status}: {ended.reason}"),
        ("mission", f"{summary.scenario}, {summary.strategy} ({summary.planner}), seed {summary.seed}"),
        ("team", f"{summary.carriers} carriers, {summary.rovers} rovers"),
        ("exploration time", explored),
        ("mission time", clock(ended.t_ms / 1000)),
        ("coverage", f"{ended.coverage:.1%} ({ended.explored_area_m2:.1f} of {ended.reachable_area_m2:.1f} m2)"),
        ("distance", f"{total_m(summary):.1f} m"),
        ("quality Q", f"{summary.quality:.3f} m2/m"),
        ("deployments", f"{ended.deployments}, retrievals {ended.retrievals}"),
        ("plans", f"{ended.replans} followed, {ended.plans_invalid} invalid, {summary.refused} refused from engines"),
        (
            "planning",
            f"median {planning.median:.3f} s, p95 {planning.p95:.3f} s, max {planning.max:.3f} s, "
            f"total {planning.total:.1f} s",
        ),
    ]


def remaining_lines(summary: MissionSummary) -> list[str]:
    """Return the stop report in short: a line for each reason why frontiers are left."""
    groups: dict[str, list[Remaining]] = {}
    for frontier in summary.ended.remaining:
        groups.setdefault(frontier.reason, []).append(frontier)
    return [f"left: {_counted(frontiers)}: {reason}" for reason, frontiers in groups.items()]


def _counted(frontiers: list[Remaining]) -> str:
    cell = frontiers[0].cell
    if len(frontiers) == 1:
        return f"a frontier of {frontiers[0].frontier_cells} cells at ({cell.x}, {cell.y})"
    return f"{len(frontiers)} frontiers of {sum(f.frontier_cells for f in frontiers)} cells, as at ({cell.x}, {cell.y})"


def total_m(summary: MissionSummary) -> float:
    """Return the sum of the distances driven, in metres."""
    return round(sum(distance for _, distance in summary.ended.distance_m), 3)


def _remaining(frontier: Remaining) -> dict[str, Any]:
    return {"cell": list(frontier.cell), "frontier_cells": frontier.frontier_cells, "reason": frontier.reason}
