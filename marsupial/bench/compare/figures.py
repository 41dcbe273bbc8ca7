"""The figures of a comparison, drawn with matplotlib.

Text and axes have one ink colour on a transparent background, so that a page can replace it; a contender has the same
colour and marker everywhere.

References
----------
Wurm et al. 2010, Figs. 6 (quality) and 7 (exploration time): means by team size with 95 % intervals.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple
from warnings import filterwarnings

import numpy as np

from marsupial.arrays import Floats
from marsupial.bench.compare.cells import QUALITY, TIME, ComparisonOutcome
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.rows import COVERAGE_SCALE, Curve
from marsupial.bench.compare.statistics import Estimate, clustered
from marsupial.exports.style import plain_style
from marsupial.library.metrics import Metric
from marsupial.wording import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

INK = "#2b3138"

# Colours of contenders: distinct for colour-blind readers too, visible on light and dark pages.
COLOURS = ("#7050dd", "#b7893f", "#0b785d", "#f03c83", "#7c87fa", "#826909")

MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("-", "--", "-.", ":", "-", "--")

WIDTH_IN = 11.8  # of all figures: that of a report's page, where a point is 4/3 pixels
PNG_DPI = 150
MOST_POINTS = 60  # of a line: all samples of all panels would make a page of megabytes

BARS = "Error bars are 95 % intervals of the mean over complete missions, where there are enough maps or starts."


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A figure as `svg` text and `png` bytes."""

    name: str
    title: str
    caption: str
    svg: str
    png: bytes
    scenario: str = ""  # the scenario, if it is about a single one


def figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    """Yield the figures of a comparison: for each scenario time and quality by team size, and coverage over time."""
    for scenario in outcome.scenarios:
        name, cases = slug(scenario), outcome.cases_of(scenario)
        cells = [(case, contender) for case in cases for contender in outcome.contenders]
        measures = [m for m in (TIME, QUALITY) if any(outcome.estimate(*cell, m) is not None for cell in cells)]
        if measures:
            drawing = _by_team_size([_row(outcome, measure, cases) for measure in measures], outcome.contenders)
            title = f"{measures[0].heading}{''.join(f' and {m.title}' for m in measures[1:])}: {scenario}"
            yield as_figure(drawing, f"time-and-quality-{name}", title, f"{title}, by team size. {BARS}", scenario)
        if any(outcome.curves_of(*cell) for cell in cells):
            yield coverage_figure(outcome, scenario, name=f"coverage-{name}")


def measure_figure(
    outcome: ComparisonOutcome,
    measure: Metric,
    scenarios: Sequence[str],
    *,
    name: str,
    rovers: Sequence[int] | None = None,
    of_paper: str = "",
) -> Figure:
    """Return a metric by team size: a row of panels for each of `scenarios`, with these numbers of rovers only.

    `of_paper` names the paper's figure.
    """
    found = {s: [c for c in outcome.cases_of(s) if rovers is None or c.rovers in rovers] for s in scenarios}
    drawing = _by_team_size([_row(outcome, measure, cases, head=s) for s, cases in found.items()], outcome.contenders)
    better = "Less" if measure.better < 0 else "More"
    title = f"{measure.heading}: {' and '.join(scenarios)}"
    place = f"{of_paper} with our data. " if of_paper else ""
    return as_figure(drawing, name, title, f"{place}{title}, by team size. {better} is better. {BARS}")


def gain_figure(
    outcome: ComparisonOutcome, measure: Metric, scenarios: Sequence[str], *, name: str, of_paper: str = ""
) -> Figure:
    """Return the gains beside each rival by team size, in per cent: a row of panels per scenario."""

    def value(case: Case, contender: Contender) -> Estimate | None:
        found = outcome.shown(case, contender, measure).estimate
        return found and found.mapped(lambda share: 100 * share)

    label = f"gain in {measure.title} [%]"
    rows = [_Row(s, outcome.cases_of(s), value, label, signed=True) for s in scenarios]
    drawing = _by_team_size(rows, outcome.rivals)
    what = f"of {outcome.base} over each" if outcome.about_base else f"over {outcome.base}"
    title = f"Gain in {measure.title} {what}: {' and '.join(scenarios)}"
    place = f"{of_paper} with our data. " if of_paper else ""
    caption = (
        f"{place}{title}, by team size, in per cent, by the geometric mean over pairs of complete missions. Error bars "
        "are 95 % intervals of that mean."
    )
    return as_figure(drawing, name, title, caption)


def coverage_figure(outcome: ComparisonOutcome, scenario: str, *, name: str) -> Figure:
    """Return the mean coverage over time, a panel for each team."""
    cases = outcome.cases_of(scenario)
    carriers, rovers = sorted({c.carriers for c in cases}), sorted({c.rovers for c in cases})
    drawing, axes = panels(len(carriers), len(rovers), height=1.75)
    for i, carrier_count in enumerate(carriers):
        for j, rover_count in enumerate(rovers):
            case = Case(scenario, carrier_count, rover_count)
            _coverage_panel(axes[i][j], outcome, case)
            axes[i][j].set_title(f"{carrier_count} x {rover_count}", fontsize=9, color=INK)
            if i == len(carriers) - 1:
                axes[i][j].set_xlabel("mission time [s]")
        axes[i][0].set_ylabel("known [%]")
    _hide_empty(axes)
    legend(drawing, axes)
    title = f"Coverage over time: {scenario}"
    caption = (
        f"{title}: known share of the reachable area, mean over all missions, complete or not; a panel for each team, "
        "carriers x rovers of each. Bands are 95 % intervals of the mean."
    )
    return as_figure(drawing, name, title, caption, scenario)


def mean_coverage(curves: Sequence[Curve]) -> tuple[Floats, Floats, Floats]:
    """Return times in s, mean coverage in per cent, half of its interval or 0, each (samples,).

    A mission that has ended keeps what it knew.
    """
    length = max(len(curve.known) for curve in curves)
    known = np.array([(*curve.known, *[curve.known[-1]] * (length - len(curve.known))) for curve in curves])
    shares = 100 * known / COVERAGE_SCALE
    mean, half, _ = clustered([curve.trial.origin for curve in curves], shares)
    times: Floats = curves[0].every_s * np.arange(length, dtype=np.float64)
    return times, mean, np.zeros(length) if half is None else half


def _coverage_panel(axes: Axes, outcome: ComparisonOutcome, case: Case) -> None:
    for k, contender in enumerate(outcome.contenders):
        if curves := outcome.curves_of(case, contender):
            times, mean, half = mean_coverage(curves)
            shown = np.linspace(0, len(times) - 1, min(len(times), MOST_POINTS)).round().astype(int)
            times, mean, half = times[shown], mean[shown], half[shown]
            colour = COLOURS[k % len(COLOURS)]
            axes.plot(times, mean, LINES[k % len(LINES)], color=colour, label=str(contender), linewidth=1.3)
            low, high = np.maximum(mean - half, 0), np.minimum(mean + half, 100)
            axes.fill_between(times, low, high, color=colour, alpha=0.18, linewidth=0)
    axes.set_ylim(0, 102)
    axes.set_xlim(left=0)


class _Row(NamedTuple):
    """A row of panels: a value by team size."""

    head: str  # what tells it from other rows, beside its label
    cases: Sequence[Case]
    value: Callable[[Case, Contender], Estimate | None]
    label: str
    from_zero: bool = False
    signed: bool = False  # whether values can be below 0


def _row(outcome: ComparisonOutcome, measure: Metric, cases: Sequence[Case], head: str = "") -> _Row:
    def value(case: Case, contender: Contender) -> Estimate | None:
        return outcome.estimate(case, contender, measure)

    return _Row(head, cases, value, f"{measure.title} [{measure.unit}]", from_zero=measure is TIME)


def _by_team_size(rows: Sequence[_Row], contenders: Sequence[Contender]) -> Drawing:
    """Draw values by the number of carriers, a panel for each number of rovers; rows of one panel share a row."""
    # with one number of carriers only, by the number of rovers
    cases = [case for row in rows for case in row.cases]
    by_rovers = len({case.carriers for case in cases}) == 1 and len({case.rovers for case in cases}) > 1
    columns = [None] if by_rovers else sorted({case.rovers for case in cases})
    beside = len(columns) == 1
    drawing, axes = panels(*((1, len(rows)) if beside else (len(rows), len(columns))), height=3.0, alike=not beside)
    for i, row in enumerate(rows):
        across = [axes[0][i]] if beside else axes[i]
        for panel, rovers in zip(across, columns, strict=True):
            chosen = sorted(case for case in row.cases if rovers is None or case.rovers == rovers)
            _size_panel(panel, chosen, contenders, row.value, by_rovers=by_rovers)
            team = f"{counted(rovers, 'rover')} per carrier" if rovers else ""
            panel.set_title(": ".join(filter(None, [row.head if len(rows) > 1 else "", team])), fontsize=9, color=INK)
            if beside or i == len(rows) - 1:
                panel.set_xlabel("rovers per carrier" if by_rovers else "carriers")
        across[0].set_ylabel(row.label)
        if row.from_zero or (across[0].get_ylim()[0] < 0 and not row.signed):
            across[0].set_ylim(bottom=0)  # now that all panels of the row, which share it, are drawn
    _hide_empty(axes)
    legend(drawing, axes)
    return drawing


def _size_panel(
    axes: Axes,
    cases: Sequence[Case],
    contenders: Sequence[Contender],
    value: Callable[[Case, Contender], Estimate | None],
    *,
    by_rovers: bool,
) -> None:
    sizes = [case.rovers if by_rovers else case.carriers for case in cases]
    for k, contender in enumerate(contenders):
        aside = 0.06 * (k - (len(contenders) - 1) / 2)
        points = [
            (size + aside, found.mean, found.sides)
            for size, case in zip(sizes, cases, strict=True)
            if (found := value(case, contender)) is not None
        ]
        if points:
            x, y, sides = zip(*points, strict=True)
            axes.errorbar(
                x, y, np.array(sides).T, color=COLOURS[k % len(COLOURS)], marker=MARKERS[k % len(MARKERS)],
                linestyle=LINES[k % len(LINES)], label=str(contender), markersize=4.5, linewidth=1.4, elinewidth=1.1,
                capsize=3,
            )  # fmt: skip
    axes.set_xticks(sorted(set(sizes)))
    axes.set_xlim(min(sizes) - 0.5, max(sizes) + 0.5)


def _hide_empty(axes: Sequence[Sequence[Axes]]) -> None:
    for panel in (panel for row in axes for panel in row):
        panel.set_visible(panel.has_data())


def panels(rows: int, columns: int, *, height: float, alike: bool = True) -> tuple[Drawing, list[list[Axes]]]:
    """Return a drawing as wide as a page, of panels of a height in inches, with room for a legend above.

    The panels of a row have the same vertical axis if they are `alike`.
    """
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(WIDTH_IN, rows * height + 0.45), layout="constrained")
    axes = drawing.subplots(rows, columns, squeeze=False, sharey="row" if alike else False)
    for panel in axes.ravel():
        panel.patch.set_alpha(0)
        panel.grid(True, color=INK, alpha=0.13, linewidth=0.7)
        panel.tick_params(colors=INK, labelsize=8)
        panel.xaxis.label.set(color=INK, fontsize=9)
        panel.yaxis.label.set(color=INK, fontsize=9)
        for side, spine in panel.spines.items():
            spine.set_visible(side in ("left", "bottom"))
            spine.set_color(INK)
    return drawing, [list(row) for row in axes]


def legend(drawing: Drawing, axes: Sequence[Sequence[Axes]]) -> None:
    """Draw one legend of all contenders above the panels."""
    named: dict[str, Any] = {}
    for panel in (panel for row in axes for panel in row):
        handles, labels = panel.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    if named:
        look: dict[str, Any] = {"frameon": False, "fontsize": 9, "labelcolor": INK, "loc": "outside upper left"}
        for columns in range(len(named), 0, -1):
            legend = drawing.legend(named.values(), named.keys(), ncols=columns, **look)
            if columns == 1 or legend.get_window_extent().width <= drawing.bbox.width:
                break
            legend.remove()


def as_figure(drawing: Drawing, name: str, title: str, caption: str, scenario: str = "") -> Figure:
    """Return a drawing as SVG and PNG, byte by byte the same for the same data."""
    svg, png = io.StringIO(), io.BytesIO()
    # matplotlib warns of letters that its font lacks, but browsers have other fonts. The filter is never removed:
    # restoring the former ones would undo what other threads set meanwhile.
    filterwarnings("ignore", message="Glyph", module=re.escape(__name__))
    with plain_style({"svg.fonttype": "none", "svg.hashsalt": name, "font.family": ["DejaVu Sans", "sans-serif"]}):
        drawing.savefig(svg, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
        drawing.savefig(png, format="png", dpi=PNG_DPI, facecolor="white", metadata={"Software": None})
    return Figure(name=name, title=title, caption=caption, svg=svg.getvalue(), png=png.getvalue(), scenario=scenario)


def slug(name: str) -> str:
    """Return a name that is usable in a file name."""
    return "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in name).strip("-") or "scenario"
