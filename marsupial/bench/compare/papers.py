"""The papers whose experiments can be carried out again, by the name the command line uses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from marsupial.bench.compare import wurm2010
from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.figures import Figure
from marsupial.bench.compare.plan import Comparison
from marsupial.bench.compare.statements import Finding
from marsupial.model.planning import Budget


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """An experiment: how to make its comparison, its figures, and what is found of its statements."""

    title: str
    runs: int
    planner: str
    comparison: Callable[[int, str, Budget], Comparison]
    figures: Callable[[ComparisonOutcome], Iterator[Figure]]
    findings: Callable[[ComparisonOutcome], list[Finding]]
    setting: str


PAPERS: Mapping[str, Experiment] = {
    wurm2010.NAME: Experiment(
        title=wurm2010.TITLE,
        runs=wurm2010.RUNS,
        planner=wurm2010.PLANNER,
        comparison=wurm2010.comparison,
        figures=wurm2010.paper_figures,
        findings=wurm2010.findings,
        setting=wurm2010.SETTING,
    ),
}
