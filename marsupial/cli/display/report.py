"""A mission's summary as text."""

from __future__ import annotations

from marsupial.cli.display.tables import print_facts, print_text
from marsupial.library.metrics import METRICS, Summary
from marsupial.model.mission import Remaining


def print_summary(summary: Summary) -> None:
    """Print the summary of a mission and its stop report."""
    print_facts(facts(summary) + ([] if summary.log is None else [("log", str(summary.log))]))
    print_text("".join(f"{line}\n" for line in remaining_lines(summary)))


def facts(summary: Summary) -> list[tuple[str, str]]:
    """Return what people want to know of a mission, by name."""
    told = {metric.title: metric.shown(summary) for metric in METRICS.values()}
    times = ("median", "p95", "max", "total")
    lines = {
        "status": f"{summary.status}: {summary.reason}",
        "mission": f"{summary.scenario}, {summary.strategy} ({summary.planner}), seed {summary.seed}",
        "team": f"{summary.carriers} carriers, {summary.robots - summary.carriers} rovers",
        "exploration time": told["exploration time"],
        "mission time": told["mission time"],
        "coverage": f"{told['coverage']} ({summary.explored_area_m2:.1f} of {told['reachable area']})",
        "distance": told["distance"],
        "quality Q": told["quality Q"],
        "deployments": f"{told['deployments']}, retrievals {told['retrievals']}",
        "plans": f"{told['replans']} followed, {told['invalid plans']} invalid, "
        f"{told['refused plans']} refused from engines",
        "planning": ", ".join(f"{time} {told[f'planning, {time}']}" for time in times),
    }
    return list(lines.items())


def remaining_lines(summary: Summary) -> list[str]:
    """Return the stop report in short: a line for each reason why frontiers are left."""
    groups: dict[str, list[Remaining]] = {}
    for frontier in summary.remaining:
        groups.setdefault(frontier.reason, []).append(frontier)
    return [f"left: {_counted(frontiers)}: {reason}" for reason, frontiers in groups.items()]


def _counted(frontiers: list[Remaining]) -> str:
    cell = frontiers[0].cell
    if len(frontiers) == 1:
        return f"a frontier of {frontiers[0].frontier_cells} cells at ({cell.x}, {cell.y})"
    return f"{len(frontiers)} frontiers of {sum(f.frontier_cells for f in frontiers)} cells, as at ({cell.x}, {cell.y})"
