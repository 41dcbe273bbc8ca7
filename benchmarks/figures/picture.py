"""The README's picture: how much sooner `temporal` knows most of a map, and all of it, than others, by kind of map."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.figures.kept import ROOT
from marsupial.bench.compare.cells import EVERYWHERE, KNOWN, TIME, ComparisonOutcome
from marsupial.bench.compare.plan import Case
from marsupial.exports.style import plain_style
from marsupial.library.metrics import Metric

RIVALS = {"assignment": "#0072b2", "heuristic-plus": "#e69f00", "wurm2010": "#009e73", "heuristic": "#cc79a7"}
NAMES = {"wurm2010": "wurm2010, the paper's method", "heuristic": "heuristic, the paper's baseline"}
PANELS = {KNOWN[2]: "until 90 % of the map is known", TIME: "until all of it is explored"}


def picture_file(name: str) -> Path:
    """Return where the picture of these kept results is."""
    return ROOT / "docs" / "pictures" / f"{name}.svg"


def drawn(outcome: ComparisonOutcome) -> str:
    """Return the picture as SVG: the same results give the same bytes with the same matplotlib."""
    places = {EVERYWHERE: outcome.cases} | {kind: outcome.cases_of(kind) for kind in sorted(outcome.scenarios)}
    style: Any = {"svg.fonttype": "none", "svg.hashsalt": "marsupial", "font.size": 9, "font.family": "sans-serif"}
    with plain_style(style):
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8, 4), layout="constrained")
        for axes, (measure, title) in zip(figure.subplots(1, len(PANELS), sharey=True), PANELS.items(), strict=True):
            _draw(axes, outcome, places, measure)
            axes.set_title(title, fontsize=10, loc="left")
        axes.set_yticks(range(len(places)), list(places))
        axes.invert_yaxis()
        figure.legend(*axes.get_legend_handles_labels(), frameon=False, loc="outside upper center", ncols=len(RIVALS))
        figure.supxlabel("how much less time temporal takes than each; left of the line: more", fontsize=9)
        made = io.StringIO()
        figure.savefig(made, format="svg", metadata={"Date": None, "Creator": None})
    return made.getvalue()


def _draw(axes: Any, outcome: ComparisonOutcome, places: Mapping[str, Sequence[Case]], measure: Metric) -> None:
    """Draw the mean and interval of each rule, by place."""
    for line, (strategy, colour) in enumerate(RIVALS.items()):
        (rival,) = (one for one in outcome.contenders if one.strategy == strategy)
        for row, cases in enumerate(places.values()):
            found = outcome.shown(cases, rival, measure).estimate
            if found is None or found.low is None or found.high is None:
                continue
            mean, *ends = (100 * share for share in (found.mean, found.low, found.high))
            at = row + 0.18 * (line - 1.5)
            axes.plot(ends, [at, at], color=colour, linewidth=2.2, solid_capstyle="butt")
            axes.plot(
                mean, at, "o", color=colour, markersize=5, label=NAMES.get(strategy, strategy) if not row else None
            )
    axes.axvline(0, color="black", linewidth=1)
    axes.axhline(0.5, color="#999999", linewidth=0.8)
    ticks = range(-20, 81, 20)
    axes.set_xticks(ticks, [f"{tick} %" for tick in ticks])
    axes.spines[["top", "right"]].set_visible(False)
