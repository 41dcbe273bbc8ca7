"""The experiment of Wurm et al. 2010: temporal planning against the deployment heuristic, in an office and a maze.

The paper's maps are not public; ours follow their descriptions. It prints no numbers except in figures, so only the
shapes of figures and the statements can be compared.

References
----------
Wurm, Dornhege, Eyerich, Stachniss, Nebel, Burgard: Coordinated Exploration with Marsupial Teams of Robots using
Temporal Symbolic Planning, IROS 2010, section IV, Eq. 2, Figs. 6 and 7.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from statistics import fmean

from marsupial.bench.compare.cells import QUALITY, TIME, ComparisonOutcome, Pairing
from marsupial.bench.compare.figures import Figure, measure_figure
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.statements import TEMPORAL, Experiment, Finding
from marsupial.bench.compare.tables import gain_text, percent
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.metrics import Metric
from marsupial.model import Scenario

MAZE, OFFICE = "maze", "office"
CARRIERS, ROVERS = (1, 2, 3, 4, 5, 6), (1, 2, 3)
FIGURE_6_ROVERS = 2

MARGINAL = 0.10
"""Greatest saving by carriers after the third that counts as marginal, as a share of a single carrier's time."""

FLAT = 0.05
"""Least saving of time by one more carrier that counts as useful."""


def _scenarios(_: Path) -> dict[Case, Scenario]:
    scenarios = {}
    for name in (OFFICE, MAZE):
        grid = builtin_scenario(name).grid  # shared by all teams, so that it is sent to each worker once
        for carriers in CARRIERS:
            for rovers in ROVERS:
                scenario = replace(builtin_scenario(name, carriers, rovers), grid=grid)
                scenarios[Case(name, carriers, rovers)] = scenario
    return scenarios


def _figures(outcome: ComparisonOutcome) -> Iterator[Figure]:
    """Yield the paper's two figures with our data: Fig. 7 has the maze above the office."""
    yield measure_figure(outcome, TIME, [MAZE, OFFICE], name="figure-7", of_paper="Fig. 7 of the paper")
    yield measure_figure(
        outcome, QUALITY, [OFFICE], name="figure-6", rovers=[FIGURE_6_ROVERS], of_paper="Fig. 6 of the paper"
    )


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    faster = "Temporal planning explores significantly faster than the baseline with every team in both environments"
    higher = "Exploration quality in the office with two rovers per carrier is significantly higher"
    alike = "Quality in the maze is much as in the office"
    return [
        _everywhere(outcome, TIME, [OFFICE, MAZE], ROVERS, faster, "section IV-C, Fig. 7"),
        _few_carriers_are_enough(outcome),
        _knee_depends_on_the_environment(outcome),
        _everywhere(outcome, QUALITY, [OFFICE], (FIGURE_6_ROVERS,), higher, "section IV-C, Fig. 6"),
        _everywhere(outcome, QUALITY, [MAZE], (FIGURE_6_ROVERS,), alike, "caption of Fig. 6"),
        _larger_teams_gain_more(outcome),
        _large_teams_work(outcome),
    ]


def _everywhere(
    outcome: ComparisonOutcome,
    measure: Metric,
    scenarios: Sequence[str],
    rovers: Sequence[int],
    statement: str,
    where: str,
) -> Finding:
    """Judge whether temporal planning is better in each of these cells."""
    planned = outcome.contenders[0]
    cases = [c for c in outcome.cases if c.scenario in scenarios and c.rovers in rovers]
    pairings = [outcome.pairing(case, planned, measure) for case in cases]
    evidence = []
    for scenario in scenarios:
        of_scenario = [pairing for pairing in pairings if pairing.case.scenario == scenario]
        cases = [pairing.case for pairing in of_scenario]
        evidence.append(_counted(scenario, of_scenario, outcome.pairing(cases, planned, measure)))
        known = sorted((p for p in of_scenario if p.gain is not None), key=lambda p: p.gain or 0.0)
        ends = {"best": known[-1], "worst": known[0]} if known else {}
        evidence += [f"{word} cell {pairing.case}: {gain_text(pairing)} %" for word, pairing in ends.items()]
    return Finding(
        statement=statement,
        where=where,
        criterion=f"in each of the {len(pairings)} cells the 95 % interval of the gain is all in its favour",
        held=[pairing.ahead for pairing in pairings],
        evidence=evidence,
    )


def _counted(scenario: str, pairings: Sequence[Pairing], pooled: Pairing) -> str:
    signs = [pairing.sign for pairing in pairings]
    ahead, behind = signs.count(1), signs.count(-1)
    word = "saving" if pooled.measure.better < 0 else "gain"
    return (
        f"{scenario}: significantly better in {ahead} of {len(signs)} cells, worse in {behind}, no difference shown in "
        f"{len(signs) - ahead - behind}; mean {word} {gain_text(pooled)} %; "
        f"pairs won/lost/tied {pooled.wins}/{pooled.losses}/{pooled.ties}"
    )


def _few_carriers_are_enough(outcome: ComparisonOutcome) -> Finding:
    held: list[bool | None] = []
    evidence = []
    for scenario in (OFFICE, MAZE):
        for rovers in ROVERS:
            times = _mean_times(outcome, scenario, rovers)
            if not {1, 3, 6} <= times.keys():
                held.append(None)
                continue
            one, three, six = times[1], times[3], times[6]
            held.append((three - six) / one <= MARGINAL)
            evidence.append(
                f"{scenario}, {rovers} per carrier: {one:.0f} s with 1 carrier, {three:.0f} s with 3, {six:.0f} s with "
                f"6; the last three save {percent((three - six) / one)} of the time of one, "
                f"{percent(1 - six / three)} of the time of three"
            )
    return Finding(
        statement="More than three carriers improve exploration time only marginally",
        where="section IV-C, Fig. 7",
        criterion=f"with temporal planning, carriers 4 to 6 together save at most {100 * MARGINAL:.0f} % of the mean "
        "time of a single carrier, in both environments and with each number of rovers",
        held=held,
        evidence=evidence,
    )


def _knee_depends_on_the_environment(outcome: ComparisonOutcome) -> Finding:
    knees = {s: [_knee(_mean_times(outcome, s, rovers)) for rovers in ROVERS] for s in (OFFICE, MAZE)}
    everything = [knee for found in knees.values() for knee in found]
    differs = None if None in everything else knees[OFFICE] != knees[MAZE]
    return Finding(
        statement="How many robots it takes until more are of little use depends on the environment",
        where="section IV-C",
        criterion=f"the least number of carriers after which one more takes less than {100 * FLAT:.0f} % off the mean "
        "time, for 1, 2 and 3 rovers per carrier, is not the same in office and maze",
        held=[differs],
        evidence=[
            f"{scenario}: {', '.join(map(_knee_text, found))} carriers with {', '.join(map(str, ROVERS))} rovers each"
            for scenario, found in knees.items()
        ],
    )


def _knee(times: dict[int, float]) -> int | None:
    """Return the number of carriers after which one more is of little use; the greatest number if always useful."""
    if len(times) < len(CARRIERS):
        return None
    flat = (few for few, more in pairwise(CARRIERS) if 1 - times[more] / times[few] < FLAT)
    return next(flat, CARRIERS[-1])


def _knee_text(knee: int | None) -> str:
    return "?" if knee is None else f"{knee} or more" if knee == CARRIERS[-1] else str(knee)


def _larger_teams_gain_more(outcome: ComparisonOutcome) -> Finding:
    planned = outcome.contenders[0]
    held: list[bool | None] = []
    evidence = []
    for scenario in (OFFICE, MAZE):
        gains: dict[bool, list[float]] = {False: [], True: []}
        for case in outcome.cases_of(scenario):
            gain = outcome.pairing(case, planned, QUALITY).gain
            if case.rovers == FIGURE_6_ROVERS and gain is not None:
                gains[case.carriers > 3].append(gain)
        if not gains[False] or not gains[True]:
            held.append(None)
            continue
        small, large = fmean(gains[False]), fmean(gains[True])
        held.append(large > max(small, 0.0))
        evidence.append(
            f"{scenario}: mean gain in Q {percent(small)} with 1 to 3 carriers, {percent(large)} with 4 to 6"
        )
    return Finding(
        statement="Larger teams above all are coordinated more efficiently",
        where="section IV-C, Fig. 6",
        criterion=f"with {FIGURE_6_ROVERS} rovers per carrier, the mean gain in Q over the baseline is positive with 4 "
        "to 6 carriers and greater than with 1 to 3, in both environments",
        held=held,
        evidence=evidence,
    )


def _large_teams_work(outcome: ComparisonOutcome) -> Finding:
    largest = [c for c in outcome.cases if (c.carriers, c.rovers) == (CARRIERS[-1], ROVERS[-1])]
    rows = [r for r in outcome.rows if r.trial.case in largest and r.trial.contender == outcome.contenders[0]]
    complete = sum(row.complete for row in rows)
    enough = len(rows) == outcome.runs * len(largest) > 0
    return Finding(
        statement="Teams of up to 24 robots, 6 carriers and 18 rovers, can be planned for",
        where="sections V-A and VI",
        criterion="every mission of that team with temporal planning is complete",
        held=[complete == len(rows) if enough else None],
        evidence=[f"{complete} of {len(rows)} missions complete"],
    )


def _mean_times(outcome: ComparisonOutcome, scenario: str, rovers: int) -> dict[int, float]:
    """Return the mean exploration time with temporal planning by the number of carriers."""
    cases = [case for case in outcome.cases_of(scenario) if case.rovers == rovers]
    found = {case.carriers: outcome.estimate(case, outcome.contenders[0], TIME) for case in cases}
    return {carriers: one.mean for carriers, one in found.items() if one is not None}


EXPERIMENT = Experiment(
    name="wurm2010",
    title="Wurm et al. 2010: Coordinated Exploration with Marsupial Teams of Robots using Temporal Symbolic Planning",
    setting="Office and maze, 1 to 6 carriers with 1 to 3 rovers each, random starts, the robots of a team side by "
    "side; carriers drive 1.0 m/s and see 10 m, rovers 0.5 m/s and 5 m; undocking takes 5 s, docking 10 s. The maps "
    "are marsupial's own, made after the paper's descriptions. Q is explored area by distance driven, the way round in "
    "which more is better, as the paper's text and Fig. 6 have it; its Eq. 2 is printed the other way round.",
    runs=30,
    paper_runs=30,
    scenarios=_scenarios,
    # statements are judged by the first method; `wurm2010` is the paper's own method
    contenders=(TEMPORAL, replace(TEMPORAL, strategy="wurm2010"), Contender("heuristic")),
    figures=_figures,
    findings=findings,
)
