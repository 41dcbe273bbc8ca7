"""The experiment of Mei et al. 2006: orientation against the widest frontier, and routes of least energy.

References
----------
Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, section V, Figs. 7 to 13.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from marsupial.arrays import Floats
from marsupial.bench.compare.cells import DISTANCE, ENERGY, ComparisonOutcome
from marsupial.bench.compare.figures import Figure, mean_coverage
from marsupial.bench.compare.plan import Case, Comparison, Contender, prepared
from marsupial.bench.compare.statements import Experiment, ExperimentTerms, Finding, share_verdict
from marsupial.bench.compare.tables import ReportTable, interval_text, mean_text, percent
from marsupial.bench.papers.mei_paths import PRINTED_LONGER, PRINTED_SAVED, RoutePairs, path_table
from marsupial.bench.papers.mei_routes import routes_figure
from marsupial.bench.papers.teams import explorers
from marsupial.generators.scattered import scattered
from marsupial.generators.walled import SIDE, WALLED
from marsupial.model.grid import FLOOR, Grid
from marsupial.model.robots import EnergyModel, RobotType, Role, Routes
from marsupial.model.scenario import Scenario

NAME = "mei"
STRUCTURED, RANDOM = tuple(WALLED), "random"
ORIENTATION, WIDEST = Contender("orientation"), Contender("widest-frontier")

PRINTED = {
    STRUCTURED[0]: ((710.8, 785.6), (1222.6, 1374.3)),
    STRUCTURED[1]: ((798.3, 889.6), (1308.3, 1445.7)),
    RANDOM: ((1075.5, 1261.3), (1207.1, 1390.1)),
}
"""Length and energy with orientation and with the widest frontier, of Figs. 8, 9 and 10."""

OBSTACLES = SIDE * SIDE // 10
"""Of the random map, which the paper draws and does not describe: its lengths are about those of the printed ones."""

SEED = 1
"""Of the random map."""

LEAST_SAVED = 0.30
SAVED_OFF, LONGER_OFF = 0.015, 0.005
"""How far from the printed shares ours may be."""

ROBOT = RobotType(
    name="robot",
    role=Role.CARRIER,
    speed_mps=1.0,
    sensor_range_m=10.0,
    radius_m=0.0,
    terrains=frozenset({FLOOR}),
    energy=EnergyModel(metre_j=1.0, stop_j=0.5, turn_j=(0.4, 0.6, 0.8, 1.0)),
    routes=Routes.ENERGY,
)
"""Section V-A; a J stands for the paper's unit of energy."""


def comparison(terms: ExperimentTerms) -> Comparison:
    """Return the comparison: one robot in two structured areas and a random one."""
    contenders = (Contender("temporal", terms.planner), ORIENTATION, WIDEST)
    return Comparison(scenarios=_scenarios(), contenders=contenders, runs=terms.runs, budget=terms.budget, paper=NAME)


def _scenarios() -> dict[Case, Scenario]:
    grids: dict[str, Grid] = {name: make() for name, make in WALLED.items()}
    grids[RANDOM] = scattered(SIDE, SIDE, OBSTACLES, SEED)
    return {Case(name, 1, 0): prepared(explorers(name, grid, ROBOT, 1)) for name, grid in grids.items()}


@cache
def _paths() -> tuple[RoutePairs, RoutePairs]:
    """Return the pairs of section V-B by the paper's rule of motion, and by that of marsupial's robots."""
    return path_table(), path_table(cuts_corners=False)


def _tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    return [_path_table(), _exploration_table(outcome)]


def _path_table() -> ReportTable:
    table = ReportTable(
        title="Routes of least energy beside shortest paths (section V-B)",
        caption="Random maps of 100 x 100 cells, a fifth of them blocked; means of the ratios of all pairs, and the "
        "ratio of "
        "the sums in brackets. Marsupial's robots do not cut corners; the paper's do.",
        heads=("rule of motion", "pairs", "energy saved", "printed", "longer", "printed"),
    )
    for rule, pairs in zip(("the paper's", "no corners cut"), _paths(), strict=True):
        saved = f"{100 * pairs.saved:.1f} % ({100 * pairs.saved_in_all:.1f} %)"
        longer = f"{100 * pairs.longer:.1f} % ({100 * pairs.longer_in_all:.1f} %)"
        printed = f"{100 * PRINTED_SAVED:.1f} %", f"{100 * PRINTED_LONGER:.1f} %"
        table.add(rule, str(len(pairs.shortest)), saved, printed[0], longer, printed[1])
    return table


def _exploration_table(outcome: ComparisonOutcome) -> ReportTable:
    planned = outcome.contenders[0]
    table = ReportTable(
        title="Distance and energy of exploring (Figs. 8 to 10)",
        caption="Means ± half of the 95 % confidence interval over starts drawn anywhere; the paper has one start "
        "each. What "
        "orientation saves against the widest frontier is beside the printed share. The last column is what temporal "
        "planning saves against orientation.",
        heads=("map", "", "orientation", "printed", "widest", "printed", "saved", "printed", str(planned), "saves"),
    )
    for name, printed in PRINTED.items():
        case = Case(name, 1, 0)
        for k, measure in enumerate((DISTANCE, ENERGY)):
            cells = [measure.title]
            for contender, numbers in zip((ORIENTATION, WIDEST), printed, strict=True):
                found = outcome.estimate(case, contender, measure)
                cells += [mean_text(found, 0, outcome.runs), f"{numbers[k]:.1f}"]
            cells += [
                percent(outcome.pairing(case, ORIENTATION, measure).gain),
                percent(1 - printed[0][k] / printed[1][k]),
                mean_text(outcome.estimate(case, planned, measure), 0, outcome.runs),
                percent(outcome.pairing(case, planned, measure, ORIENTATION).gain),
            ]
            table.add(name, *cells)
    return table


def _figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    """Yield Figs. 8 to 10 with our maps; Figs. 11 to 13 are the coverage over time of each map."""
    for number, case, scenario in zip((8, 9, 10), outcome.cases, _scenarios().values(), strict=False):
        if outcome.curves_of(case, ORIENTATION):
            yield routes_figure(scenario, (ORIENTATION, WIDEST), name=f"figure-{number}", about=case.scenario)


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    """Return what the data say of the statements of section V."""
    return [
        _paths_finding(),
        _structured(outcome),
        _random(outcome),
        _widest_leads_at_first(outcome),
        _planning(outcome),
    ]


def _paths_finding() -> Finding:
    pairs, ours = _paths()
    held = [abs(pairs.saved - PRINTED_SAVED) <= SAVED_OFF, abs(pairs.longer - PRINTED_LONGER) <= LONGER_OFF]
    return Finding(
        statement="Energy-efficient paths save 8.4 % energy and are 0.7 % longer than shortest ones",
        where="section V-B",
        criterion=f"over more than 3800 pairs ours save within {100 * SAVED_OFF:.1f} points of it, and are longer "
        "within "
        f"{100 * LONGER_OFF:.1f} points",
        verdict=share_verdict(held),
        evidence=(
            f"{len(pairs.shortest)} pairs: {100 * pairs.saved:.2f} % saved, {100 * pairs.longer:.2f} % longer",
            f"by the rule of marsupial's robots: {100 * ours.saved:.2f} % and {100 * ours.longer:.2f} %",
        ),
    )


def _structured(outcome: ComparisonOutcome) -> Finding:
    pairings = [
        (measure, outcome.pairing(Case(name, 1, 0), ORIENTATION, measure))
        for name in STRUCTURED
        for measure in (DISTANCE, ENERGY)
    ]
    return Finding(
        statement="With structured obstacles orientation saves about 40 % of distance and energy",
        where="section V-C, Figs. 8 and 9",
        criterion=f"in both areas it saves at least {100 * LEAST_SAVED:.0f} % of either in the mean",
        verdict=share_verdict([None if p.gain is None else p.gain >= LEAST_SAVED for _, p in pairings]),
        evidence=tuple(
            f"{p.case.scenario}, {m.title}: {percent(p.gain)}, {interval_text(p.ahead, 0)} {m.unit}"
            for m, p in pairings
        ),
    )


def _random(outcome: ComparisonOutcome) -> Finding:
    found = [(m, outcome.pairing(Case(RANDOM, 1, 0), ORIENTATION, m)) for m in (DISTANCE, ENERGY)]
    return Finding(
        statement="Among random obstacles it saves about 10 %",
        where="section V-C, Fig. 10",
        criterion="it saves distance and energy in the mean, and less than in either structured area",
        verdict=share_verdict([None if p.gain is None else 0 < p.gain < LEAST_SAVED for _, p in found]),
        evidence=tuple(f"{m.title}: {percent(p.gain)}, {interval_text(p.ahead, 0)} {m.unit}" for m, p in found),
    )


def _widest_leads_at_first(outcome: ComparisonOutcome) -> Finding:
    held: list[bool | None] = []
    evidence = []
    for name in PRINTED:
        curves = [outcome.curves_of(Case(name, 1, 0), contender) for contender in (ORIENTATION, WIDEST)]
        if not all(curves):
            held.append(None)
            continue
        (times, ours, _), (_, theirs, _) = (mean_coverage(of_one) for of_one in curves)
        ahead = _lead(theirs, ours)
        last = float(times[ahead[-1]]) if len(ahead) else 0.0
        held.append(0 < last < float(times[-1]))
        evidence.append(f"{name}: the widest frontier knows more until {last:.0f} s, orientation from then on")
    return Finding(
        statement="The widest frontier covers more at the beginning and less later",
        where="section V-C, Figs. 11 to 13",
        criterion="on each map its mean coverage is ahead by more than a point at some time, and behind or equal from "
        "a later "
        "one on",
        verdict=share_verdict(held),
        evidence=tuple(evidence),
    )


def _lead(theirs: Floats, ours: Floats) -> np.ndarray:
    """Return the samples at which the first is ahead by more than a point of a per cent."""
    count = min(len(theirs), len(ours))
    return np.flatnonzero(theirs[:count] > ours[:count] + 1.0)


def _planning(outcome: ComparisonOutcome) -> Finding:
    planned = outcome.contenders[0]
    pairings = [outcome.pairing(Case(name, 1, 0), planned, DISTANCE, ORIENTATION) for name in STRUCTURED]
    return Finding(
        statement="Temporal planning drives less than orientation in the structured areas",
        where="no statement of the paper: what marsupial claims of itself",
        criterion="in both areas its mean distance is shorter",
        verdict=share_verdict([None if p.gain is None else p.gain > 0 for p in pairings]),
        evidence=tuple(f"{p.case.scenario}: {percent(p.gain)}, {interval_text(p.ahead, 0)} m" for p in pairings),
    )


EXPERIMENT = Experiment(
    title="Mei et al. 2006: Energy-Efficient Mobile Robot Exploration",
    setting="One robot in areas of 100 x 100 cells: two with walls and small doors, drawn after what the paper tells "
    "of its "
    "own, and one with a tenth of its cells blocked at random. The robot sees 10 cells, drives a cell in a second and "
    "takes routes of least energy; driving a cell takes 1 J, which stands for the paper's unit of energy, a stop 0.5, "
    "a "
    "turn of 45, 90, 135 or 180 degrees 0.4, 0.6, 0.8 or 1.0. Starts are drawn by the seeds. Robots do not cut "
    "corners.",
    runs=10,
    planner="anytime",
    comparison=comparison,
    figures=_figures,
    findings=findings,
    tables=_tables,
)
