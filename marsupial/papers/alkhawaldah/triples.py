"""The sweep of all three weights of Al-Khawaldah et al.: only their ratios matter, and no weight above 10 is needed.

References: Al-Khawaldah, Livatino, Lee, section 3 ("Experimental Work").
"""

import math
from itertools import product

from marsupial.bench.compare.cells import TIME, ComparisonOutcome
from marsupial.bench.compare.plan import Case, Contender
from marsupial.bench.compare.statements import Experiment, Finding
from marsupial.papers.alkhawaldah.experiment import CELLS, ROBOTS, cell_world

WORLDS = {Case(f"{obstacles} obstacles", ROBOTS, 0): obstacles for obstacles in (10, 20)}

CONTENDERS = {
    (n, p, c): Contender(f"bidding/W_n={n}/W_p={p}/W_c={c}") for n, p, c in product((1, 2, 5, 10, 20), repeat=3)
}
"""W_n, W_p and W_c. The paper has all whole numbers, to 10 in each of its worlds and to 20 in these two."""

GREATEST = 10


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    """Return the findings on the statements about three weights; triples that did not finish in time are omitted."""
    enough, alike = [], []  # by world: whether weights up to GREATEST do, and whether equal ratios take equal steps
    evidence: tuple[list[str], list[str]] = ([], [])
    for case in WORLDS:
        found = {triple: outcome.estimate(case, contender, TIME) for triple, contender in CONTENDERS.items()}
        steps = {triple: one.mean for triple, one in found.items() if one is not None}
        if not steps:
            continue
        few = min((mean for triple, mean in steps.items() if max(triple) <= GREATEST), default=math.inf)
        least = min(steps.values())
        enough.append(few == least)
        evidence[0].append(f"{case.scenario}: {few:.0f} steps, with all weights {least:.0f}")
        by_ratio: dict[tuple[float, float], set[float]] = {}
        for (n, p, c), mean in steps.items():
            by_ratio.setdefault((n / c, p / c), set()).add(mean)
        same = sum(len(means) == 1 for means in by_ratio.values())
        alike.append(same == len(by_ratio))
        evidence[1].append(f"{case.scenario}: the same steps for {same} of {len(by_ratio)} ratios")
    return [
        Finding(
            statement=f"Weights above {GREATEST} give no better result",
            where="section 3",
            criterion=f"in both worlds the least number of steps is reached with weights up to {GREATEST}",
            held=enough,
            evidence=evidence[0],
        ),
        Finding(
            statement="Weights with the same ratios lead to the same steps",
            where="section 3",
            criterion="in both worlds all triples with the same ratios have the same number of steps",
            held=alike,
            evidence=evidence[1],
        ),
    ]


EXPERIMENT = Experiment(
    name="alkhawaldah-triples",
    title="Al-Khawaldah et al.: three weights of the bidding function",
    setting="The worlds of 10 and 20 obstacles of Table 2, with the same starts for every triple: W_n, W_p and W_c are "
    "each 1, 2, 5, 10 or 20, where the paper has all whole numbers from 1 to 20.",
    runs=1,
    scenarios=lambda _: {case: cell_world(case.scenario, CELLS, CELLS, n) for case, n in WORLDS.items()},
    contenders=tuple(CONTENDERS.values()),
    findings=findings,
    overview=False,
)
