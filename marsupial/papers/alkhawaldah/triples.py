"""The sweep of all three weights of Al-Khawaldah et al.: only their ratios count, and none above 10 is needed.

References: Al-Khawaldah, Livatino, Lee, section 3 ("Experimental Work").
"""

from collections.abc import Iterable
from itertools import product

from marsupial.bench.compare.cells import TIME, ComparisonOutcome
from marsupial.bench.compare.plan import Case, Comparison, Contender, prepared
from marsupial.bench.compare.statements import Experiment, ExperimentTerms, Finding
from marsupial.papers.alkhawaldah.experiment import CELLS, ROBOTS, cell_world

NAME = "alkhawaldah-triples"
WORLDS = {Case(f"{obstacles} obstacles", ROBOTS, 0): obstacles for obstacles in (10, 20)}

TRIPLES = tuple(product((1, 2, 5, 10, 20), repeat=3))
"""W_n, W_p and W_c. The paper has all whole numbers, to 10 in each of its worlds and to 20 in these two."""

GREATEST = 10

Steps = dict[tuple[int, ...], float]  # mean steps by W_n, W_p and W_c, without those that did not end in time


def comparison(terms: ExperimentTerms) -> Comparison:
    """Return the comparison: every triple of weights in both worlds."""
    scenarios = {
        case: prepared(cell_world(case.scenario, CELLS, CELLS, obstacles, ROBOTS)) for case, obstacles in WORLDS.items()
    }
    contenders = tuple(map(_contender, TRIPLES))
    return Comparison(scenarios=scenarios, contenders=contenders, runs=terms.runs, budget=terms.budget, paper=NAME)


def _contender(triple: Iterable[int]) -> Contender:
    weights = zip(("W_n", "W_p", "W_c"), triple, strict=True)
    return Contender("/".join(("bidding", *(f"{name}={value}" for name, value in weights))))


def findings(outcome: ComparisonOutcome) -> list[Finding]:
    """Return the findings on the statements about three weights."""
    steps = {}
    for case in WORLDS:
        found = {triple: outcome.estimate(case, _contender(triple), TIME) for triple in TRIPLES}
        steps[case.scenario] = {triple: one.mean for triple, one in found.items() if one is not None}
    return [_no_better(steps), _ratios_alone_count(steps)]


def _no_better(steps: dict[str, Steps]) -> Finding:
    least = {
        world: [min((s for triple, s in found.items() if max(triple) <= most), default=None) for most in (GREATEST, 20)]
        for world, found in steps.items()
    }
    return Finding(
        statement=f"Weights above {GREATEST} give no better result",
        where="section 3",
        criterion=f"in both worlds the least number of steps is reached with weights up to {GREATEST}",
        held=[None if few is None else few == all_ for few, all_ in least.values()],
        evidence=[f"{world}: least {few:.0f}, with 20 {all_:.0f}" for world, (few, all_) in least.items() if few],
    )


def _ratios_alone_count(steps: dict[str, Steps]) -> Finding:
    held: list[bool | None] = []
    evidence = []
    for world, found in steps.items():
        alike: dict[tuple[float, float], set[float]] = {}
        for (n, p, c), mean in found.items():
            alike.setdefault((n / c, p / c), set()).add(mean)
        same = sum(len(means) == 1 for means in alike.values())
        held.append(same == len(alike) if alike else None)
        evidence.append(f"{world}: the same steps for {same} of {len(alike)} ratios")
    return Finding(
        statement="Weights with the same ratios lead to the same steps",
        where="section 3",
        criterion="in both worlds all triples with the same ratios have the same number of steps",
        held=held,
        evidence=evidence,
    )


EXPERIMENT = Experiment(
    title="Al-Khawaldah et al.: three weights of the bidding function",
    setting="The worlds of 10 and 20 obstacles of Table 2, with the same starts for every triple: W_n, W_p and W_c are "
    "each 1, 2, 5, 10 or 20, where the paper has all whole numbers from 1 to 20.",
    runs=1,
    paper_runs=None,
    planner="anytime",
    comparison=comparison,
    figures=lambda outcome: iter(()),
    findings=findings,
    overview=False,
)
