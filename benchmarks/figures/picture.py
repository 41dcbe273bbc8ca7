"""The README's picture: in how much less time `temporal` explores than each rule, by kind of map, from kept results."""

import io
from pathlib import Path
from typing import Any

from benchmarks.figures.kept import ROOT
from marsupial.bench.compare.cells import EVERYWHERE, TIME, ComparisonOutcome
from marsupial.exports.style import plain_style

RIVALS = {"assignment": "#0072b2", "heuristic-plus": "#e69f00", "wurm2010": "#009e73", "heuristic": "#cc79a7"}
NAMES = {"wurm2010": "wurm2010, the paper's method", "heuristic": "heuristic, the paper's baseline"}


def picture_file(name: str) -> Path:
    """Return where the picture of these kept results is."""
    return ROOT / "docs" / "pictures" / f"{name}.svg"


def drawn(outcome: ComparisonOutcome) -> str:
    """Return the picture as SVG: the same results give the same bytes with the same matplotlib."""
    places = {EVERYWHERE: outcome.cases} | {kind: outcome.cases_of(kind) for kind in sorted(outcome.scenarios)}
    style: Any = {"svg.fonttype": "none", "svg.hashsalt": "marsupial", "font.size": 9, "font.family": "sans-serif"}
    with plain_style(style):
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8, 3.6), layout="constrained")
        axes = figure.subplots()
        for line, (strategy, colour) in enumerate(RIVALS.items()):
            (rival,) = (one for one in outcome.contenders if one.strategy == strategy)
            for row, cases in enumerate(places.values()):
                found = outcome.shown(cases, rival, TIME).estimate
                if found is None or found.low is None or found.high is None:
                    continue
                mean, *ends = (100 * share for share in (found.mean, found.low, found.high))
                at = row + 0.18 * (line - 1.5)
                axes.plot(ends, [at, at], color=colour, linewidth=2.2, solid_capstyle="butt")
                label = NAMES.get(strategy, strategy) if row == 0 else None
                axes.plot(mean, at, "o", color=colour, markersize=5, label=label)
        axes.axvline(0, color="black", linewidth=1)
        axes.axhline(0.5, color="#999999", linewidth=0.8)
        ticks = range(-20, 81, 20)
        axes.set_xticks(ticks, [f"{tick} %" for tick in ticks])
        axes.set_xlabel("how much less time temporal explores in than each; left of the line: in more")
        axes.set_yticks(range(len(places)), list(places))
        axes.invert_yaxis()
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, loc="lower right", labelspacing=0.25, borderpad=0)
        made = io.StringIO()
        figure.savefig(made, format="svg", metadata={"Date": None, "Creator": None})
    return made.getvalue()
