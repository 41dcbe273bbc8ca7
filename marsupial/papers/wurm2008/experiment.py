"""The experiment of Wurm et al. 2008: segments of the map against the closest frontier, in two real offices.

References: Wurm, Stachniss, Burgard, IROS 2008, sections IV and VI-A, Figs. 2 to 5.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import fmean

import numpy as np

from marsupial.bench.compare.cells import TIME, ComparisonOutcome, Pairing
from marsupial.bench.compare.figures import Figure, gain_figure, measure_figure
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.statements import TEMPORAL, Experiment, Finding
from marsupial.bench.compare.tables import ReportTable, gain_text, percent
from marsupial.bench.suite.maps import REAL_FOLDER, real_files
from marsupial.formats.mapfiles.read import read_map
from marsupial.generators.builtin import explorers
from marsupial.model import FLOOR, OBSTACLE, Grid, RobotType, Scenario
from marsupial.model.robots import default_types
from marsupial.papers.wurm2008.figure import segments_figure

NAME, CLUTTER = "wurm2008", "wurm2008-clutter"
TEAMS = {"fr079": (2, 3, 4, 5, 6), "cartesium": (2, 3, 4, 5, 6, 7, 8)}

SHOWN_TEAM = 3
"""Robots of the mission of Figs. 2 and 3."""

RADIUS_M, SPEED_MPS, RANGE_M = 0.15, 0.5, 5.0
"""Properties of each robot, which the paper does not give. A wider one can't reach much of both maps as drawn."""

BOXES, BOX_M, BOX_SEED = 60, (0.2, 0.8), 1
"""Number, sides and seed of the boxes that clutter the Cartesium. The paper does not describe the clutter it added."""

SEGMENTS, CLOSEST = Contender("segmentation"), Contender("closest-frontier")


def _scenarios(maps: Path, *, clutter: bool = False) -> dict[Case, Scenario]:
    scenarios: dict[Case, Scenario] = {}
    for (name, sizes), file in zip(TEAMS.items(), real_files(TEAMS, maps), strict=True):
        grid = read_map(file).grid
        if clutter and name == "cartesium":
            grid = cluttered(grid)
        for robots in sizes:
            scenarios[Case(name, robots, 0)] = explorers(name, grid, _robot(), robots)
    return scenarios


def cluttered(grid: Grid) -> Grid:
    """Return the map with boxes on its floor, in places drawn by `BOX_SEED`."""
    rng = np.random.default_rng(BOX_SEED)
    cells = grid.cells.copy()
    corners = rng.choice(np.argwhere(cells == FLOOR), BOXES)
    sides = np.ceil(rng.uniform(*BOX_M, (BOXES, 2)) / grid.resolution_m).astype(int)
    for (y, x), (height, width) in zip(corners, sides, strict=True):
        box = cells[y : y + height, x : x + width]
        box[box == FLOOR] = OBSTACLE
    return replace(grid, cells=cells)


def _robot() -> RobotType:
    carrier, _ = default_types(1)
    return replace(carrier, name="robot", radius_m=RADIUS_M, speed_mps=SPEED_MPS, sensor_range_m=RANGE_M)


def _figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    yield gain_figure(outcome, TIME, outcome.scenarios, name="figure-5", of_paper="Fig. 5 of the paper")
    yield measure_figure(outcome, TIME, outcome.scenarios, name="times")
    name = next(iter(TEAMS))
    if outcome.rows and (file := REAL_FOLDER / f"{name}.yaml").exists():
        yield segments_figure(explorers(name, read_map(file).grid, _robot(), SHOWN_TEAM))


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    by_map = {name: [outcome.pairing(case, SEGMENTS, TIME) for case in outcome.cases_of(name)] for name in TEAMS}
    by_gain = [finding(by_map) for finding in (_faster, _more_in_the_larger, _less_in_large_teams)]
    return [*by_gain, _more_robots_are_quicker(outcome), _planning(outcome)]


def _line(pairing: Pairing) -> str:
    return f"{pairing.case}: {gain_text(pairing)} %, won/lost {pairing.wins}/{pairing.losses}"


def _faster(by_map: dict[str, list[Pairing]]) -> Finding:
    pairings = [pairing for found in by_map.values() for pairing in found]
    return Finding(
        statement="Assigning robots to segments explores significantly faster than the closest frontier",
        where="section VI-A, Fig. 5",
        criterion="for each map and team the 95 % interval of the gain is above zero",
        held=[pairing.ahead for pairing in pairings],
        evidence=list(map(_line, pairings)),
    )


def _more_in_the_larger(by_map: dict[str, list[Pairing]]) -> Finding:
    gains = {name: [one.gain for one in pairings if one.gain is not None] for name, pairings in by_map.items()}
    means = {name: fmean(found) if found else None for name, found in gains.items()}
    known = [mean for mean in means.values() if mean is not None]
    return Finding(
        statement="The gain is bigger on the map of the Cartesium, which has several large rooms",
        where="section VI-A, Fig. 5",
        criterion="the mean gain over all teams is greater on the second map than on the first",
        held=[known[1] > known[0] if len(known) == 2 else None],
        evidence=[f"{name}: {percent(mean)} in the mean over teams" for name, mean in means.items()],
    )


def _less_in_large_teams(by_map: dict[str, list[Pairing]]) -> Finding:
    held: list[bool | None] = []
    evidence = []
    for name, pairings in by_map.items():
        gains = {pairing.case.carriers: pairing.gain for pairing in pairings}
        known = {robots: gain for robots, gain in gains.items() if gain is not None}
        best = max(known, key=lambda robots: known[robots], default=None)
        held.append(None if best is None else best < max(known))
        most = f": greatest with {best} robots, {percent(known[max(known)])} with the most" if known else ""
        evidence.append(f"{name}{most}")
    return Finding(
        statement="The gain decreases for large teams in small environments",
        where="section VI-A, Fig. 5",
        criterion="on each map the gain is greatest with fewer robots than the largest team has",
        held=held,
        evidence=evidence,
    )


def _more_robots_are_quicker(outcome: ComparisonOutcome) -> Finding:
    held: list[bool | None] = []
    evidence = []
    for name in TEAMS:
        found = [outcome.estimate(case, SEGMENTS, TIME) for case in outcome.cases_of(name)]
        means = [one.mean for one in found if one is not None]
        held.append(means[-1] < means[0] if len(means) == len(found) else None)
        evidence.append(f"{name}: {', '.join(f'{mean:.0f}' for mean in means)} s by size of the team")
    return Finding(
        statement="The time to explore still gets smaller as robots are added",
        where="section VI-A",
        criterion="on each map the largest team has a shorter mean time with segments than the smallest",
        held=held,
        evidence=evidence,
    )


def _planning(outcome: ComparisonOutcome) -> Finding:
    planned = outcome.contenders[0]
    cases = [case for name in TEAMS for case in outcome.cases_of(name)]
    pairings = [outcome.pairing(case, planned, TIME, SEGMENTS) for case in cases]
    return Finding(
        statement="Temporal planning explores at least as fast as segments",
        where="no statement of the paper: what marsupial claims of itself",
        criterion="for each map and team its mean time is not longer",
        held=[None if p.gain is None else p.gain >= 0 for p in pairings],
        evidence=list(map(_line, pairings)),
    )


def _tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    table = ReportTable(
        title="Gain of segments over the closest frontier (Fig. 5)",
        caption="Share of the exploration time saved in per cent, with its 95 % interval over starts. The paper "
        "draws its gains in a figure and prints no number of them.",
        heads=("map", "robots", "gain, %"),
    )
    for case in outcome.cases:
        table.add(case.scenario, str(case.carriers), gain_text(outcome.pairing(case, SEGMENTS, TIME)))
    return [table]


EXPERIMENT = Experiment(
    name=NAME,
    title="Wurm et al. 2008: Coordinated Multi-Robot Exploration using a Segmentation of the Environment",
    setting="Building 079 of the University of Freiburg with 2 to 6 robots and the Cartesium of the University of "
    "Bremen with 2 to 8, from real laser maps of these buildings (fr079, cartesium). Robots drive 0.5 m/s, see 5 m all "
    "around and have a radius of 0.15 m, none of which the paper gives; the robots of a team start side by side, "
    "where is drawn. The paper's simulations were given a segmentation into rooms and corridors; ours is computed "
    "during the mission from the partial map, as its section IV describes.",
    runs=6,
    paper_runs=20,
    scenarios=_scenarios,
    contenders=(TEMPORAL, SEGMENTS, CLOSEST),
    figures=_figures,
    findings=findings,
    tables=_tables,
)

CLUTTER_EXPERIMENT = replace(
    EXPERIMENT,
    name=CLUTTER,
    title=f"{EXPERIMENT.title}, with clutter",
    setting=f"{EXPERIMENT.setting} As in the paper, clutter is added to the Cartesium: {BOXES} boxes at random, with "
    f"sides of {BOX_M[0]} to {BOX_M[1]} m.",
    scenarios=partial(_scenarios, clutter=True),
)
