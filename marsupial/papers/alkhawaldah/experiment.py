"""The experiment of Al-Khawaldah et al.: two robots in worlds of cells, two bidding functions.

References: Al-Khawaldah, Livatino, Lee, sections II-A, 3 and III (the paper's numbers), Eqs. 1 and 2, Table 2,
Fig. 8.
"""

from collections.abc import Iterator
from pathlib import Path
from statistics import fmean
from typing import Any

from marsupial.bench.compare.cells import TIME, ComparisonOutcome
from marsupial.bench.compare.figures import COLOURS, INK, LINES, MARKERS, Figure, as_figure, legend, panels
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.statements import TEMPORAL, Experiment, Finding
from marsupial.bench.compare.statistics import Estimate
from marsupial.bench.compare.tables import ReportTable, mean_text, percent
from marsupial.generators.builtin import explorers
from marsupial.generators.papers import scattered
from marsupial.model import FLOOR, RobotType, Role, Scenario

CELLS = 25  # columns and rows of most worlds
SEED = 1  # seed of the obstacles' places

HOPPER = RobotType(
    name="robot", role=Role.CARRIER, speed_mps=1.0, sensor_range_m=1.5, radius_m=0.4, terrains=frozenset({FLOOR}),
    diagonal=1.0,
)  # fmt: skip
"""A robot that sees its eight neighbours and moves one cell a second; with `--interference`, alone in its cell."""

ROBOTS = 2
BIDDING, SHENG = Contender("bidding"), Contender("sheng")

PRINTED = {
    0: (158.7, 128.0), 1: (155.4, 127.0), 2: (155.7, 126.2), 5: (155.2, 124.6),
    10: (153.3, 122.6), 20: (163.3, 123.3), 30: (158.8, 122.9), 40: (155.6, 123.1),
}  # fmt: skip
"""Table 2: steps of Sheng's and of the paper's bidding function, by the number of obstacles."""

NEAR = 0.05
"""Tolerance of our numbers relative to the printed ones, and greatest variation of means that count as constant."""

FEW_STEPS = 115  # greatest mean number of steps of temporal planning; a printed mean is 125


def cell_world(name: str, columns: int, rows: int, obstacles: int, robots: int = ROBOTS) -> Scenario:
    """Return the scenario of robots in a world of 1 m cells, some of which are obstacles."""
    return explorers(name, scattered(columns, rows, obstacles, SEED), HOPPER, robots)


def _scenarios(_: Path) -> dict[Case, Scenario]:
    cases = {obstacles: _case(obstacles) for obstacles in PRINTED}
    return {case: cell_world(case.scenario, CELLS, CELLS, obstacles) for obstacles, case in cases.items()}


def _estimates(outcome: ComparisonOutcome, contender: Contender) -> dict[int, Estimate]:
    found = {obstacles: outcome.estimate(_case(obstacles), contender, TIME) for obstacles in PRINTED}
    return {obstacles: one for obstacles, one in found.items() if one is not None}


def _means(outcome: ComparisonOutcome, contender: Contender) -> dict[int, float]:
    return {obstacles: one.mean for obstacles, one in _estimates(outcome, contender).items()}


def _case(obstacles: int) -> Case:
    return Case(f"{obstacles} obstacles", ROBOTS, 0)


def _tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    planned = outcome.contenders[0]
    table = ReportTable(
        title="Table 2: steps until everything is explored",
        caption="Mean ± half of the 95 % confidence interval, the printed means, and how far ours are from them. The "
        "last column has the mean of the columns above it.",
        heads=("obstacles", "sheng", "printed", "off", "bidding", "printed", "off", str(planned), "beside bidding"),
    )
    for obstacles, printed in PRINTED.items():
        cells = []
        for contender, number in zip((SHENG, BIDDING), printed, strict=True):
            found = outcome.estimate(_case(obstacles), contender, TIME)
            off = None if found is None else found.mean / number - 1
            cells += [mean_text(found, 1, outcome.runs), f"{number:.1f}", percent(off)]
        ours = mean_text(outcome.estimate(_case(obstacles), planned, TIME), 1, outcome.runs)
        gain = outcome.pairing(_case(obstacles), planned, TIME, BIDDING).gain
        table.add(str(obstacles), *cells, ours, percent(gain))
    return [table]


def _figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    drawing, axes = panels(1, 1, height=3.4)
    panel = axes[0][0]
    looks = zip(COLOURS, MARKERS, LINES, strict=True)
    for contender, (colour, marker, line) in zip(outcome.contenders, looks, strict=False):
        if found := _estimates(outcome, contender):
            half = [one.half or 0.0 for one in found.values()]
            look: dict[str, Any] = {"color": colour, "marker": marker, "linestyle": line, "label": str(contender)}
            means = [one.mean for one in found.values()]
            panel.errorbar(list(found), means, half, markersize=4.5, linewidth=1.4, capsize=3, **look)
    for contender, printed, line in zip((SHENG, BIDDING), zip(*PRINTED.values(), strict=True), LINES[3:], strict=False):
        look = {"color": INK, "linestyle": line, "label": f"{contender}, printed"}
        panel.plot(list(PRINTED), printed, linewidth=1.0, alpha=0.55, **look)
    panel.set_xlabel("obstacles")
    panel.set_ylabel("steps")
    panel.set_ylim(bottom=0)
    legend(drawing, axes)
    caption = (
        "Fig. 8 of the paper with our data, and the numbers of its Table 2. Less is better. Error bars are 95 % "
        "intervals of the mean over complete missions."
    )
    yield as_figure(drawing, "figure-8", "Steps by the number of scattered obstacles", caption)


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    return [_always_better(outcome), _fixed(outcome), _as_printed(outcome), _planning(outcome)]


def _always_better(outcome: ComparisonOutcome) -> Finding:
    bidding, sheng = _means(outcome, BIDDING), _means(outcome, SHENG)
    both = [obstacles for obstacles in PRINTED if obstacles in bidding and obstacles in sheng]
    return Finding(
        statement="Bidding with the recommended weights is always better than the function of Sheng et al.",
        where="section III, Table 2, Fig. 8",
        criterion="the mean number of steps is less in each of the eight worlds",
        held=[bidding[n] < sheng[n] if n in both else None for n in PRINTED],
        evidence=[f"{n} obstacles: {bidding[n]:.1f} and {sheng[n]:.1f} steps" for n in both],
    )


def _fixed(outcome: ComparisonOutcome) -> Finding:
    means = _means(outcome, BIDDING)
    level = fmean(means.values()) if means else 0.0
    return Finding(
        statement="The time of bidding is about the same whatever the number and places of the obstacles",
        where="section III",
        criterion=f"in each world the mean is within {100 * NEAR:.0f} % of the mean of all",
        held=[abs(means[n] / level - 1) <= NEAR if n in means else None for n in PRINTED],
        evidence=[f"{min(means.values()):.1f} to {max(means.values()):.1f} steps, mean {level:.1f}"] if means else [],
    )


def _as_printed(outcome: ComparisonOutcome) -> Finding:
    means = _means(outcome, BIDDING)
    off = {n: means[n] / printed[1] - 1 for n, printed in PRINTED.items() if n in means}
    return Finding(
        statement="Bidding takes 122.6 to 128 steps",
        where="Table 2",
        criterion=f"in each world our mean is within {100 * NEAR:.0f} % of the printed one",
        held=[abs(off[n]) <= NEAR if n in off else None for n in PRINTED],
        evidence=[f"{n} obstacles: {means[n]:.1f}, printed {PRINTED[n][1]}: {percent(off[n])}" for n in off],
    )


def _planning(outcome: ComparisonOutcome) -> Finding:
    means = _means(outcome, outcome.contenders[0])
    level = fmean(means.values()) if len(means) == len(PRINTED) else None
    gains = [outcome.pairing(_case(n), outcome.contenders[0], TIME, BIDDING).gain for n in PRINTED]
    held = [None if level is None else level <= FEW_STEPS]
    held += [None if gain is None else gain >= 0 for gain in gains]
    return Finding(
        statement=f"Temporal planning takes {FEW_STEPS} steps or fewer, and in no world more than bidding",
        where="no statement of the paper: what marsupial claims of itself",
        criterion=f"the mean over all worlds is {FEW_STEPS} or less, and its mean in each is not more than bidding's",
        held=held,
        evidence=[f"{level:.1f} steps in the mean over all worlds"] if level is not None else [],
    )


EXPERIMENT = Experiment(
    name="alkhawaldah",
    title="Al-Khawaldah et al.: Frontier-based Exploration with Two Cooperating Mobile Robots",
    setting="Worlds of 25 x 25 cells with 0 to 40 obstacles of a cell, their places the same for all missions; what "
    "lies outside counts as occupied. Two robots start beside each other, where is drawn, see the eight cells around "
    "them and hop to one of the eight neighbours each step, diagonals included, but not between two obstacles that "
    "touch at a corner. With --interference, the partner is an obstacle, as in the paper; without, they may share a "
    "cell. A step is a second of the simulated clock. The weights are those that the paper recommends: "
    "W_p = 2, W_n = 2, W_c = 1; for Sheng's function w_1 = w_2 = 1 and w_3 = 0, as in the paper's comparison.",
    runs=40,
    paper_runs=10,
    scenarios=_scenarios,
    contenders=(TEMPORAL, BIDDING, SHENG),
    figures=_figures,
    findings=findings,
    tables=_tables,
    parts={"weights": "alkhawaldah-weights"},
)
