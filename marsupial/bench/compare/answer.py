"""The answer of a comparison as a sentence and a plot: in how much less time one explores than the other, pair by pair.

A gain is a share of the other one's time in the same mission, and their mean is over the same pairs as the counts of
pairs won and lost beside it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from marsupial.bench.compare.cells import TIME, ComparisonOutcome, Pairing
from marsupial.bench.compare.figures import COLOURS, INK, MARKERS, Figure, as_figure, legend, panels
from marsupial.bench.compare.plan import Contender
from marsupial.bench.compare.statistics import Estimate
from marsupial.wording import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

NAME = "answer"
ROW_IN = 0.3
SPREAD = 0.13  # greatest vertical offset of the dots of pairs, as a share of a row's height


def sentence(outcome: ComparisonOutcome) -> str:
    """Return how the best rival of the base stands against it."""
    if not outcome.rivals:
        return _alone(outcome, outcome.contenders[0])
    gains = [(outcome.pairing(outcome.cases, rival, TIME).gain, rival) for rival in outcome.rivals]
    _, best = min(gains, key=lambda pair: np.inf if pair[0] is None else -pair[0])
    return _sentence(outcome, best)


def _alone(outcome: ComparisonOutcome, contender: Contender) -> str:
    times = [estimate_ for case in outcome.cases if (estimate_ := outcome.estimate(case, contender, TIME))]
    if not times:
        return f"Nothing can be said about {contender} yet: none of its missions is complete."
    mean = sum(one.mean * one.count for one in times) / sum(one.count for one in times)
    missions = counted(sum(one.count for one in times), "complete mission")
    return f"{contender} explores in {mean:.0f} s on average over {missions}."


def _sentence(outcome: ComparisonOutcome, rival: Contender) -> str:
    stands, (one, other) = outcome.shown(outcome.cases, rival, TIME), outcome.sides(rival)
    gain = stands.estimate
    if gain is None:
        return f"Nothing can be said about {one} yet: it has no mission complete that {other} has completed too."
    maps = " and ".join(filter(None, (", ".join(outcome.scenarios[:-1]), outcome.scenarios[-1])))
    pairs = f"{counted(gain.count, 'pair')} of missions on {maps}"
    if gain.half is None:
        few = f"{gain.units}: too few for an interval"
        said = f"{one} explores in {less_time(gain.mean)} than {other} on average over {pairs} ({few})"
    elif gain.sign == 0:
        said = (
            f"Whether {one} or {other} explores in less time can't be told from {pairs}: "
            f"{one} explores in {less_time(gain.mean)} on average{_interval(gain)}"
        )
    else:
        said = f"{one} explores in {less_time(gain.mean)} than {other} on average over {pairs}{_interval(gain)}"
    odds = ", so the few differ by more" if gain.mean * (stands.wins - stands.losses) < 0 else ""
    return f"{said}; it needs less in {stands.wins} and more in {stands.losses}{odds}."


def less_time(share: float) -> str:
    """Return in words how much less time one takes, as a share of the other one's."""
    return f"{100 * abs(share):.1f} % {'less' if share >= 0 else 'more'} time"


def _interval(found: Estimate) -> str:
    """Return the interval of a relative gain, and the units it rests on."""
    if found.low is None or found.high is None:
        return ""
    ends = f"{100 * found.low:+.1f} to {100 * found.high:+.1f} %"
    return f" (95 % interval of how much less, over {found.units}: {ends})"


def answer_figure(outcome: ComparisonOutcome) -> Figure | None:
    """Return the plot of how much less time exploration takes, beside each rival; None without any pair."""
    drawing = answer_drawing(outcome)
    if drawing is None:
        return None
    title = f"How much less time exploration takes: {' than '.join(outcome.all_sides)}"
    caption = (
        f"{title}, in per cent of the other one's time in the same mission. A faint dot is a pair of missions, a large "
        "mark their mean, with its 95 % interval if there are enough maps or starts for one; beside it how many pairs "
        "are won and lost."
    )
    return as_figure(drawing, NAME, title, caption)


def answer_drawing(outcome: ComparisonOutcome) -> Drawing | None:
    """Return that plot as a drawing of matplotlib, to be drawn and written in `plain_style`."""
    rows = list(_rows(outcome))
    if not any(stands.logs for _, found in rows for stands in found):
        return None
    drawing, ((axes,),) = panels(1, 1, height=0.9 + ROW_IN * len(rows) * max(1, len(outcome.rivals)))
    axes.axvline(0, color=INK, linewidth=1.2)
    several = len(outcome.rivals)
    for row, (_, found) in enumerate(rows):
        for k, stands in enumerate(found):
            y = row + (k - (several - 1) / 2) * 0.7 / several
            _draw(axes, y, stands, k, str(outcome.rivals[k]) if row == 0 else "")
    axes.set_yticks(range(len(rows)), [label for label, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.get_yticklabels()[0].set_fontweight("bold")
    axes.grid(False, axis="y")
    who = " than ".join(outcome.all_sides)
    axes.set_xlabel(f"← more time  ·  less exploration time, {who} [%]  ·  less →")
    if several > 1:
        legend(drawing, [[axes]])
    return drawing


def _rows(outcome: ComparisonOutcome) -> Iterator[tuple[str, list[Pairing]]]:
    for where, cases in outcome.places.items():
        yield where, [outcome.shown(cases, rival, TIME) for rival in outcome.rivals]


def _draw(axes: Any, y: float, stands: Pairing, k: int, label: str) -> None:
    """Draw the pairs, their mean and its interval, and write the numbers of pairs won and lost."""
    gain = stands.estimate
    if gain is None:
        return
    colour = COLOURS[k % len(COLOURS)]
    x = 100 * np.array(stands.gains)
    aside = SPREAD * np.sin(1.2 + 2.4 * np.arange(len(x)))  # spreads the dots around the bar, the same way every time
    axes.plot(x, y + aside, linestyle="", marker=".", markersize=4, color=colour, alpha=0.35, zorder=2)
    look: dict[str, Any] = {"marker": MARKERS[k % len(MARKERS)], "markersize": 8, "elinewidth": 2.2, "capsize": 4}
    bar = [[100 * side] for side in gain.sides]
    axes.errorbar(100 * gain.mean, y, xerr=bar, color=colour, label=label or None, zorder=3, **look)
    counts = f"{100 * gain.mean:+.1f} %: won {stands.wins}, lost {stands.losses}"
    axes.annotate(counts, (1.01, y), xycoords=("axes fraction", "data"), fontsize=8.5, color=INK, va="center")
