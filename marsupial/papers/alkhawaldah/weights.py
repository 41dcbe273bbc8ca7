"""The sweep of weights of Al-Khawaldah et al.: which weights of the bidding function explore quickly.

References: Al-Khawaldah, Livatino, Lee, section 3 ("Experimental Work"), Figs. 3 to 7.
"""

from collections.abc import Iterable, Iterator
from itertools import product
from statistics import fmean

import numpy as np

from marsupial.arrays import Flags, Floats
from marsupial.bench.compare.cells import TIME, ComparisonOutcome
from marsupial.bench.compare.figures import COLOURS, INK, Figure, as_figure, panels
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.statements import Experiment, Finding
from marsupial.bench.compare.tables import ReportTable
from marsupial.papers.alkhawaldah.experiment import CELLS, ROBOTS, cell_world

WORLDS = {
    "no obstacles": (CELLS, CELLS, 0),
    "10 obstacles": (CELLS, CELLS, 10),
    "20 obstacles": (CELLS, CELLS, 20),
    "40 obstacles": (CELLS, CELLS, 40),
    "31 x 31, 15 obstacles": (31, 31, 15),
    "20 x 25, 10 obstacles": (20, 25, 10),
}
"""Columns, rows and obstacles of the worlds of Figs. 3 to 6, 7 and of the text, which does not count obstacles."""

VALUES = tuple(map(float, range(11)))
"""Values of W_n and W_p, with W_c = 1: from 0 to 10 as in the paper, in steps of 1 instead of 0.1."""

BEST = 0.10  # share of the range from the shortest to the longest time in which times count as best

GREATEST = 7.0
RECOMMENDED = (2.0, 2.0)
RATIO = 2.0  # greatest ratio of W_n and W_p near the line of slope 1


def _contender(of_neighbours: float, of_partner: float) -> Contender:
    return Contender(f"bidding/W_n={of_neighbours:g}/W_p={of_partner:g}")


def _times(outcome: ComparisonOutcome, world: str) -> Floats:
    """Return the mean steps (W_n, W_p), NaN without data."""
    found = [outcome.estimate(Case(world, ROBOTS, 0), _contender(*pair), TIME) for pair in product(VALUES, VALUES)]
    means = [np.nan if one is None else one.mean for one in found]
    return np.array(means).reshape(len(VALUES), len(VALUES))


def best(times: Floats) -> Flags:
    """Return which times are in the best 10 % of their range, as in the paper; False for NaN."""
    if np.isnan(times).all():
        return np.zeros(times.shape, dtype=np.bool_)
    low, high = np.nanmin(times), np.nanmax(times)
    return np.asarray(times <= low + BEST * (high - low))


def _figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    drawing, axes = panels(2, 3, height=3.2)
    values, limits = np.array(VALUES), (min(VALUES) - 0.4, max(VALUES) + 0.4)
    for panel, world in zip((panel for row in axes for panel in row), WORLDS, strict=True):
        i, j = np.nonzero(best(_times(outcome, world)))
        panel.scatter(values[j], values[i], marker="s", s=11, color=INK)
        panel.axline((0, 0), slope=1, color=COLOURS[0], linewidth=0.9, linestyle="--")
        panel.set_xlim(*limits)
        panel.set_ylim(*limits)
        panel.set_aspect("equal")
        panel.set_title(world, fontsize=9, color=INK)
        panel.set_xlabel("W_p")
        panel.set_ylabel("W_n")
    caption = (
        "Figs. 3 to 7 of the paper with our data: the pairs of weights, with W_c = 1, whose time is within the best "
        "10 % of the range between the shortest and the longest. The line has slope 1."
    )
    yield as_figure(drawing, "figures-3-to-7", "Weights with the shortest times", caption)


def _tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    table = ReportTable(
        title="Steps by world",
        caption="Shortest, recommended (W_p = W_n = 2) and longest number of steps over all pairs of weights, and how "
        "many pairs are among the best 10 %. Pairs of which a mission did not end in time count in none of these.",
        heads=("world", "shortest", "with W_p = W_n = 2", "longest", "pairs among the best"),
    )
    for world in WORLDS:
        times = _times(outcome, world)
        if not np.isnan(times).all():
            steps = (np.nanmin(times), _recommended(times), np.nanmax(times))
            table.add(world, *(f"{step:.0f}" for step in steps), f"{np.count_nonzero(best(times))} of {times.size}")
    return [table]


def _recommended(times: Floats) -> float:
    return float(times[VALUES.index(RECOMMENDED[0]), VALUES.index(RECOMMENDED[1])])


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    times = {world: _times(outcome, world) for world in WORLDS}
    return [_never_great(times), _near_the_line(times), _recommended_is_good(times)]


def _pairs(times: Floats) -> list[tuple[float, float]]:
    return [(VALUES[i], VALUES[j]) for i, j in np.argwhere(best(times)).tolist()]


def _never_great(times: dict[str, Floats]) -> Finding:
    greatest = {world: max((max(pair) for pair in _pairs(t)), default=None) for world, t in times.items()}
    return Finding(
        statement="Neither W_p nor W_n should ever go beyond 6 or 7 beside W_c = 1",
        where="section 3, Figs. 3 to 7",
        criterion=f"in each world no pair among the best 10 % has a weight above {GREATEST:g}",
        held=[None if most is None else most <= GREATEST for most in greatest.values()],
        evidence=[f"{world}: up to {most:g}" for world, most in greatest.items() if most is not None],
    )


def _near_the_line(times: dict[str, Floats]) -> Finding:

    def share(pairs: Iterable[tuple[float, float]]) -> float:
        return fmean(max(pair) <= RATIO * min(pair) for pair in pairs)

    shares = {world: share(pairs) for world, found in times.items() if (pairs := _pairs(found))}
    chance = share(product(VALUES, VALUES))
    return Finding(
        statement="The best weights scatter around the line of slope 1",
        where="section 3, Figs. 3 to 7",
        criterion=f"in each world a greater share of the best pairs than of all pairs ({100 * chance:.0f} %) has one "
        f"weight at most {RATIO:g} times the other",
        held=[shares[world] > chance if world in shares else None for world in times],
        evidence=[f"{world}: {100 * share:.0f} % of the best pairs" for world, share in shares.items()],
    )


def _recommended_is_good(times: dict[str, Floats]) -> Finding:
    known = {world: t for world, t in times.items() if not np.isnan(_recommended(t))}
    return Finding(
        statement="W_p = W_n = 2 gives times within or very close to the best 10 %",
        where="section 3",
        criterion="in each world its time is within the best 20 % of the range",
        held=[_position(known[w]) <= 2 * BEST if w in known else None for w in times],
        evidence=[
            f"{w}: {_recommended(t):.0f} steps, at {100 * _position(t):.0f} % of the range" for w, t in known.items()
        ],
    )


def _position(times: Floats) -> float:
    """Return the position of the recommended weights in the range of times, from 0 to 1."""
    low, high = np.nanmin(times), np.nanmax(times)
    return float((_recommended(times) - low) / (high - low)) if high > low else 0.0


EXPERIMENT = Experiment(
    name="alkhawaldah-weights",
    title="Al-Khawaldah et al.: the weights of the bidding function",
    setting="The worlds and robots of Table 2 and two of other sizes, with the same obstacles and starts for every "
    "pair of weights: W_n and W_p from 0 to 10 in steps of 1, where the paper has steps of 0.1, with W_c = 1.",
    runs=1,
    scenarios=lambda _: {Case(name, ROBOTS, 0): cell_world(name, *world) for name, world in WORLDS.items()},
    contenders=tuple(_contender(*pair) for pair in product(VALUES, VALUES)),
    figures=_figures,
    findings=findings,
    tables=_tables,
    overview=False,
)
