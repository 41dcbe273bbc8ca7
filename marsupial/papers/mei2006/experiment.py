"""The experiments of Mei et al.: energy-efficient exploration by one robot, and energy-efficient routes.

References: Mei, Lu, Lee and Hu: Energy-Efficient Mobile Robot Exploration, ICRA 2006, section V, Figs. 8 to 13.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from marsupial.bench.compare.cells import DISTANCE, ENERGY, ComparisonOutcome
from marsupial.bench.compare.figures import COLOURS, INK, Figure, as_figure, coverage_figure, mean_coverage
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.statements import TEMPORAL, Experiment, Finding
from marsupial.bench.compare.tables import ReportTable, mean_text, percent
from marsupial.exports.trails import drives as drives_of
from marsupial.exports.trails import trail
from marsupial.generators.builtin import explorers
from marsupial.generators.canvas import close_border
from marsupial.generators.papers import SIDE, WALLED, scattered
from marsupial.library.missions import simulate
from marsupial.library.recording import Recorder
from marsupial.maps.reach import largest_reach
from marsupial.mission.playback import Playback
from marsupial.model import FLOOR, OBSTACLE, Budget, Cell, EnergyModel, Grid, RobotType, Role, Routes, Scenario
from marsupial.papers.mei2006 import paths
from marsupial.papers.mei2006.paths import PRINTED_LONGER, PRINTED_SAVED, path_table

SEED, ONE_STEP = 1, Budget(steps=1)
"""The seed of the start in the figures of routes, and a budget for strategies that ask no planner."""

ORIENTATION, WIDEST = Contender("orientation"), Contender("widest-frontier")

ROBOT = RobotType(
    name="robot", role=Role.CARRIER, speed_mps=1.0, sensor_range_m=10.0, radius_m=0.0, terrains=frozenset({FLOOR}),
    energy=EnergyModel(metre_j=1.0, stop_j=0.5, turn_j=(0.4, 0.6, 0.8, 1.0)), routes=Routes.ENERGY,
)  # fmt: skip
"""Section V-A: a cell is a metre, and driving a metre takes a joule."""

RANDOM = "random obstacles"
SHARE = 0.1
"""Share of random obstacles at which, as in Fig. 10, routes are about 1.1 km and energy is 1.17 times the distance."""

STRUCTURED = tuple(WALLED)
PRINTED = {
    STRUCTURED[0]: ((710.8, 785.6), (1222.6, 1374.3)),
    STRUCTURED[1]: ((798.3, 889.6), (1308.3, 1445.7)),
    RANDOM: ((1075.5, 1261.3), (1207.1, 1390.1)),
}
"""Figs. 8 to 10: distance and energy of the paper's method and of the widest frontier."""

MUCH = 0.3  # savings of distance and energy on structured maps that count as the paper's about 40 %
NEAR_SAVED, NEAR_LONGER = 0.015, 0.005  # tolerance of our means of routes relative to the printed ones


def _grids() -> dict[str, Grid]:
    area = scattered(SIDE, SIDE, round(SHARE * SIDE * SIDE), seed=1)
    cells = area.cells.copy()
    close_border(cells)  # as in the paper
    return {**{name: make() for name, make in WALLED.items()}, RANDOM: replace(area, cells=cells)}


def _from_corner(name: str, grid: Grid) -> Scenario:
    scenario = explorers(name, grid, ROBOT, 1)
    y, x = np.nonzero(largest_reach(grid, ROBOT))
    nearest = int(np.argmin(x - y))
    (robot,) = scenario.team
    return replace(scenario, team=(replace(robot, start=Cell(int(x[nearest]), int(y[nearest]))),))


def _case(name: str) -> Case:
    return Case(name, 1, 0)


def _tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    """Return Figs. 8 to 10 as a table with the printed numbers, and the routes of section V-B."""
    return [*_corner_tables(outcome), *([_routes()] if outcome.rows else [])]


def _corner_tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    planned = outcome.contenders[0]
    table = ReportTable(
        title="Figs. 8 to 10: distance and energy",
        caption="Ours, as mean ± half of the 95 % confidence interval where there are several missions, and the "
        "printed numbers, each of one mission on a map of the paper's own. What is saved is over the widest frontier.",
        heads=(
            "map",
            "",
            *(head for one in ("orientation", "widest-frontier", "saved") for head in (one, "printed")),
            str(planned),
            "beside orientation",
        ),
    )
    for name, numbers in PRINTED.items():
        case = _case(name)
        for k, measure in enumerate((DISTANCE, ENERGY)):
            ours, theirs = numbers[0][k], numbers[1][k]
            means = [mean_text(outcome.estimate(case, one, measure), 1, outcome.runs) for one in outcome.contenders]
            saved = percent(outcome.pairing(case, ORIENTATION, measure).gain)
            beside = percent(outcome.pairing(case, planned, measure, ORIENTATION).gain)
            what = f"{measure.title} [{measure.unit}]"
            printed = (f"{ours:.1f}", f"{theirs:.1f}", percent(1 - ours / theirs))
            table.add(name, what, means[1], printed[0], means[2], printed[1], saved, printed[2], means[0], beside)
    return [table]


def _routes() -> ReportTable:
    table = ReportTable(
        title="Section V-B: routes of least energy beside shortest paths",
        caption=f"On {paths.MAPS} maps of {paths.SIDE} x {paths.SIDE} cells, a fifth of them blocked at "
        "random. Means of the ratios over all pairs and, behind them, ratios of the sums.",
        heads=("movement", "pairs", "energy saved", "printed", "longer", "printed"),
    )
    for rule, cuts in (("past corners, as in the paper", True), ("corners kept, as everywhere in marsupial", False)):
        pairs = path_table(cuts_corners=cuts)
        both = zip(pairs.gains, pairs.gains_in_all, strict=True)
        saved, longer = (f"{percent(mean)} ({percent(in_all)})" for mean, in_all in both)
        table.add(rule, str(len(pairs.shortest)), saved, percent(PRINTED_SAVED), longer, percent(PRINTED_LONGER))
    return table


def _figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    for number, name in enumerate(PRINTED, start=11):
        if any(curve.trial.case.scenario == name for curve in outcome.curves):
            yield coverage_figure(outcome, name, name=f"figure-{number}")


def _corner_figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    scenarios = {name: _from_corner(name, grid) for name, grid in _grids().items()}
    for number, (name, scenario) in enumerate(scenarios.items(), start=8):
        if any(row.trial.case.scenario == name for row in outcome.rows):
            yield routes_figure(scenario, (ORIENTATION, WIDEST), name=f"figure-{number}", about=name)
    yield from _figures(outcome)


def routes_figure(scenario: Scenario, contenders: Sequence[Contender], *, name: str, about: str) -> Figure:
    """Return the routes of contenders without a planner, from a random start."""
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(3.4 * len(contenders), 3.7), layout="constrained")
    walls = np.where(scenario.grid.cells == OBSTACLE, 1.0, np.nan)
    for panel, contender in zip(drawing.subplots(1, len(contenders), squeeze=False)[0], contenders, strict=True):
        recorder = Recorder()
        summary = simulate(
            scenario,
            strategy=contender.strategy,
            planner=contender.planner,
            budget=ONE_STEP,
            seed=SEED,
            observer=recorder,
        )
        panel.imshow(walls, origin="lower", cmap="gray", vmin=0, vmax=2.5, interpolation="nearest")
        played = Playback(recorder.events)
        (drives,) = drives_of(played).values()
        panel.plot(*trail(drives, played.end_ms).T, color=COLOURS[0], linewidth=0.9)
        panel.plot(*drives[0].cells[0], "o", color=COLOURS[1], markersize=5)
        panel.set_title(f"{contender}: {summary.distance_m:.0f} m, {summary.energy_j:.0f} J", fontsize=9, color=INK)
        panel.set_axis_off()
    title = f"Routes: {about}"
    of_paper = f"{name.replace('-', ' ').capitalize()} of the paper with our map. "
    caption = f"{of_paper}{title}, of the mission with seed {SEED}; the dot is the start."
    return as_figure(drawing, name, title, caption, about)


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    return [_routes_save(outcome), *corner_findings(outcome)]


def corner_findings(outcome: ComparisonOutcome) -> list[Finding]:
    found = (_much_less, _less_among_random_obstacles, _ahead_at_first, _planning)
    return [finding(outcome) for finding in found]


def _routes_save(outcome: ComparisonOutcome) -> Finding:
    found = path_table(cuts_corners=True) if outcome.rows else None
    held: list[bool | None] = [None, None]
    evidence = []
    if found is not None:
        saved, longer = found.gains
        held = [abs(saved - PRINTED_SAVED) <= NEAR_SAVED, abs(longer - PRINTED_LONGER) <= NEAR_LONGER]
        evidence = [f"{len(found.shortest)} pairs: {100 * saved:.2f} % saved, {100 * longer:.2f} % longer"]
    return Finding(
        statement="On average energy-efficient paths save 8.4 % energy and are 0.7 % longer than shortest paths",
        where="section V-B",
        criterion=f"our means are within {100 * NEAR_SAVED:.1f} and {100 * NEAR_LONGER:.1f} points of these",
        held=held,
        evidence=evidence,
    )


def _gains(outcome: ComparisonOutcome, name: str, ours: Contender, base: Contender) -> list[float | None]:
    """Return the shares of distance and energy that a contender saves over another."""
    return [outcome.pairing(_case(name), ours, measure, base).gain for measure in (DISTANCE, ENERGY)]


def _line(name: str, gains: list[float | None]) -> str:
    return f"{name}: {percent(gains[0])} distance and {percent(gains[1])} energy saved"


def _much_less(outcome: ComparisonOutcome) -> Finding:
    gains = {name: _gains(outcome, name, ORIENTATION, WIDEST) for name in STRUCTURED}
    return Finding(
        statement="In areas with structured obstacles, orientation takes about 40 % less distance and energy than the "
        "widest frontier",
        where="section V-C, Figs. 8 and 9",
        criterion=f"on both maps it saves {100 * MUCH:.0f} % or more of each in the mean",
        held=[None if gain is None else gain >= MUCH for both in gains.values() for gain in both],
        evidence=[_line(name, both) for name, both in gains.items()],
    )


def _less_among_random_obstacles(outcome: ComparisonOutcome) -> Finding:
    gains = _gains(outcome, RANDOM, ORIENTATION, WIDEST)
    most = [gain for name in STRUCTURED for gain in _gains(outcome, name, ORIENTATION, WIDEST) if gain is not None]
    held = [None if gain is None or not most else 0 < gain < min(most) for gain in gains]
    return Finding(
        statement="Among random obstacles it saves as well, but less: 10.1 % of the distance and 9.3 % of the energy",
        where="section V-C, Fig. 10",
        criterion="it saves some of each in the mean, and less than on either structured map",
        held=held,
        evidence=[_line(RANDOM, gains)],
    )


def _ahead_at_first(outcome: ComparisonOutcome) -> Finding:
    held: list[bool | None] = []
    evidence = []
    for name in PRINTED:
        curves = [outcome.curves_of(_case(name), one) for one in (WIDEST, ORIENTATION)]
        if not all(curves):
            held.append(None)
            continue
        (times, theirs, _), (others, ours, _) = (mean_coverage(found) for found in curves)
        ahead = [theirs[k] > ours[k] for k in range(min(len(times), len(others)))]
        leads = [float(times[k]) for k, lead in enumerate(ahead) if lead]
        held.append(bool(leads) and not ahead[-1])
        share = 100 * len(leads) / len(ahead) if ahead else 0.0
        when = f"knows more in {share:.0f} % of the time, for the last at {leads[-1]:.0f} s" if leads else ""
        evidence.append(f"{name}: it {when or 'never knows more'}")
    return Finding(
        statement="The widest frontier covers more at the beginning and lags behind later",
        where="section V-C, Figs. 11 to 13",
        criterion="on each map its mean coverage is greater than that of orientation for a while, and less when "
        "orientation's missions end",
        held=held,
        evidence=evidence,
    )


def _planning(outcome: ComparisonOutcome) -> Finding:
    planned = outcome.contenders[0]
    gains = {name: _gains(outcome, name, planned, ORIENTATION) for name in STRUCTURED}
    return Finding(
        statement="Temporal planning takes less distance than orientation",
        where="no statement of the paper: what marsupial claims of itself",
        criterion="on both structured maps its mean distance is less",
        held=[None if both[0] is None else both[0] > 0 for both in gains.values()],
        evidence=[_line(name, both) for name, both in gains.items()],
    )


SETTING = (
    "an area of 100 x 100 cells of 1 m: a hall with three rooms, a corridor with six, or random obstacles of a cell, a "
    "tenth of them all. The maps are drawn after what the paper says of its own, shown in small pictures only. "
    "The robot takes the ways of least energy: 1 J a metre, 0.5 J a stop, 0.4, 0.6, 0.8 and 1 J a turn of 45, 90, 135 "
    "and 180 degrees. Orientation and the widest frontier choose again when the target is no frontier any more: the "
    "paper leaves open when."
)

EXPERIMENT = Experiment(
    name="mei",
    title="Mei et al.: Energy-Efficient Mobile Robot Exploration",
    setting=f"One robot, a point that sees 10 m far in line of sight, starts anywhere in {SETTING}",
    runs=10,
    paper_runs=1,
    scenarios=lambda _: {_case(name): explorers(name, grid, ROBOT, 1) for name, grid in _grids().items()},
    contenders=(TEMPORAL, ORIENTATION, WIDEST),
    figures=_figures,
    findings=findings,
    tables=_tables,
    parts={"corner": "mei-corner"},
)

CORNER_EXPERIMENT = Experiment(
    name="mei-corner",
    title="Mei et al.: from the upper left corner",
    setting=f"One mission each, as in the paper: the robot starts in the upper left corner of {SETTING}",
    runs=1,
    paper_runs=1,
    scenarios=lambda _: {_case(name): _from_corner(name, grid) for name, grid in _grids().items()},
    contenders=(TEMPORAL, ORIENTATION, WIDEST),
    figures=_corner_figures,
    findings=corner_findings,
    tables=_corner_tables,
)
