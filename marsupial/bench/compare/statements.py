"""The statements of a paper, in our words, and the verdict of a comparison on each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.figures import Figure
from marsupial.bench.compare.plan import Case, Comparison, Contender, prepared
from marsupial.bench.compare.tables import ReportTable
from marsupial.bench.suite.maps import PLANNER
from marsupial.model import Budget, Scenario
from marsupial.model.planning import NO_PLANNER
from marsupial.wording import counted


class StatementVerdict(StrEnum):
    """Whether a statement holds in the data, by its criterion."""

    HOLDS = "holds"
    PARTLY = "holds in part"
    FAILS = "does not hold"
    OPEN = "not enough data"


READING = (
    "A statement about several cells or environments holds where its criterion is met in all of them, in part where it "
    "is met in at least half."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A statement of a paper and its verdict."""

    statement: str
    where: str  # its place in the paper
    criterion: str  # the test on the data
    held: Sequence[bool | None]  # in each place that the statement is about; None without data
    evidence: Sequence[str]  # the figures

    @property
    def verdict(self) -> StatementVerdict:
        """Whether the statement holds in all of its places, as `READING` says."""
        known = [one for one in self.held if one is not None]
        if not known or len(known) < len(self.held):
            return StatementVerdict.OPEN
        if all(known):
            return StatementVerdict.HOLDS
        return StatementVerdict.PARTLY if 2 * sum(known) >= len(known) else StatementVerdict.FAILS


TEMPORAL = Contender("temporal", PLANNER)


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """An experiment of a paper: its comparison, its figures and its findings."""

    name: str  # in `marsupial reproduce`
    title: str
    setting: str  # what is simulated
    runs: int  # missions per case, unless the caller asks for another number
    scenarios: Callable[[Path], Mapping[Case, Scenario]]  # given the folder with the maps of real buildings
    contenders: tuple[Contender, ...]  # those with a planner get the one that is asked for
    findings: Callable[[ComparisonOutcome], list[Finding]]
    paper_runs: int | None = None  # missions behind the paper's means; None if it does not say
    figures: Callable[[ComparisonOutcome], Iterator[Figure]] = lambda outcome: iter(())
    tables: Callable[[ComparisonOutcome], list[ReportTable]] = lambda outcome: []  # printed numbers beside ours
    overview: bool = True  # whether to add the usual tables and figures of a comparison
    parts: Mapping[str, str] = field(default_factory=dict)  # further experiments of the paper, by subfolder

    def comparison(self, *, runs: int, planner: str, budget: Budget, maps: Path) -> Comparison:
        """Return the missions: every contender in every scenario, from the same starts."""
        return Comparison(
            scenarios={case: _as_in_papers(prepared(one)) for case, one in self.scenarios(maps).items()},
            contenders=tuple(c if c.planner == NO_PLANNER else replace(c, planner=planner) for c in self.contenders),
            runs=runs,
            budget=budget,
            paper=self.name,
        )


def _as_in_papers(scenario: Scenario) -> Scenario:
    """Return a scenario in which any frontier is a target, however little ground there may be behind it."""
    return replace(scenario, goal=replace(scenario.goal, least_ground=0.0))


def reading(runs: int, paper_runs: int | None) -> str:
    """Return how to read the verdicts, given the numbers of missions behind our means and the paper's."""
    papers = "" if paper_runs is None else f", the paper's {paper_runs}"
    few = " With so few, wide intervals hide what there may be." if runs < (paper_runs or 0) else ""
    return f"{READING} Each cell has {counted(runs, 'mission')}{papers}.{few}"


def checklist(findings: Sequence[Finding], introduction: str) -> str:
    """Return an introduction and findings as Markdown."""
    lines = ["## Statements of the paper", "", introduction, ""]
    for finding in findings:
        lines += [
            f"- **{finding.verdict}**: {finding.statement} ({finding.where})",
            f"  - Criterion: {finding.criterion}",
            *(f"  - {line}" for line in finding.evidence),
        ]
    return "\n".join(lines) + "\n"
