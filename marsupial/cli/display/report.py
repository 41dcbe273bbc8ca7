"""A mission's summary as text, and summaries side by side."""

from collections.abc import Sequence

from marsupial.cli.display.tables import print_facts, print_table, print_text
from marsupial.library.metrics import METRICS, Summary
from marsupial.model import Cell, Grid, Remaining
from marsupial.model.mission import KNOWN_PERCENT
from marsupial.wording import counted

SAVED = ("known_50_s", "known_90_s", "exploration_time_s", "mission_time_s", "distance_m", "energy_j")
"""Metrics of which less is better, shown with their saving."""

OTHERS = (
    "coverage", "quality", "deployments", "retrievals", "replans", "plans_invalid", "planning_s.median",
    "planning_s.total", "analysis_s",
)  # fmt: skip


def print_summary(summary: Summary, grid: Grid) -> None:
    """Print the summary of a mission on a map, and its stop report."""
    print_facts(facts(summary) + ([] if summary.log is None else [("log", str(summary.log))]))
    print_text("".join(f"{line}\n" for line in remaining_lines(summary, grid)))


def facts(summary: Summary) -> list[tuple[str, str]]:
    """Return the lines of a mission's summary as names and values."""
    shown = {metric.title: metric.shown(summary) for metric in METRICS.values()}
    times = ("median", "p95", "max", "total")
    refused = f"{shown['invalid plans']} invalid, {shown['refused plans']} refused from engines"
    lines = [
        ("status", f"{summary.status}: {summary.reason}"),
        ("mission", f"{summary.scenario}, {summary.strategy} ({summary.planner}), seed {summary.seed}"),
        ("team", f"{counted(summary.carriers, 'carrier')}, {counted(summary.robots - summary.carriers, 'rover')}"),
        *((title, shown[title]) for title in ("exploration time", "mission time")),
        ("known", ", ".join(f"{p} % {shown[f'{p} % known']}" for p in KNOWN_PERCENT)),
        ("coverage", f"{shown['coverage']} ({summary.explored_area_m2:.1f} of {shown['reachable area']})"),
        *((title, shown[title]) for title in ("distance", "quality Q")),
        ("deployments", f"{shown['deployments']}, retrievals {shown['retrievals']}"),
        ("plans", f"{shown['replans']} followed, {refused}"),
        ("planning", ", ".join(f"{time} {shown[f'planning, {time}']}" for time in times)),
        ("analysis", shown["analysis"]),
    ]
    if summary.interference is not None:
        waits, deadlocks = summary.interference.waits, summary.interference.deadlocks
        waited = f"{counted(waits, 'wait')}, {summary.interference.waited_s:.0f} s in all"
        lines.append(("interference", f"{waited}, {counted(deadlocks, 'deadlock')} resolved"))
    return lines


def remaining_lines(summary: Summary, grid: Grid) -> list[str]:
    """Return the stop report as a line for each reason why frontiers are left."""
    groups: dict[str, list[Remaining]] = {}
    for frontier in summary.remaining:
        groups.setdefault(frontier.reason, []).append(frontier)
    return [f"left: {_frontiers(frontiers, grid)}: {reason}" for reason, frontiers in groups.items()]


def _frontiers(frontiers: list[Remaining], grid: Grid) -> str:
    cells = counted(sum(frontier.frontier_cells for frontier in frontiers), "cell")
    place = place_text(grid, frontiers[0].cell)
    if len(frontiers) == 1:
        return f"a frontier of {cells} at {place}"
    return f"{len(frontiers)} frontiers of {cells}, one of them at {place}"


def place_text(grid: Grid, cell: Cell) -> str:
    """Return the position of a cell as text: its centre in metres, and its column and row."""
    x, y = (round(metres, 1) + 0.0 for metres in grid.centre_m(cell))
    return f"x {x:.1f}, y {y:.1f} m (cell {cell.x}, {cell.y}, counted from the lower left)"


def print_comparison(summaries: Sequence[Summary]) -> None:
    """Print a table with a column per mission, and the savings of the first against the last."""
    from marsupial.bench.compare.plan import Contender

    heads = ["", *(str(Contender(summary.strategy, summary.planner)) for summary in summaries), "saved"]
    rows = []
    for key in SAVED:
        first, last = METRICS[key].of(summaries[0]), METRICS[key].of(summaries[-1])
        saved = "" if len(summaries) == 1 or first is None or not last else f"{1 - first / last:.1%}"
        rows.append(_row(key, summaries, saved))
    rows.append(["status", *(str(summary.status) for summary in summaries), ""])
    rows += [_row(key, summaries) for key in OTHERS]
    print_table(heads, rows, right=range(1, len(heads)))


def _row(key: str, summaries: Sequence[Summary], saved: str = "") -> list[str]:
    return [METRICS[key].title, *(METRICS[key].shown(summary) for summary in summaries), saved]
