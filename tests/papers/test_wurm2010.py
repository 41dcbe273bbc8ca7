from dataclasses import replace
from pathlib import Path

import pytest
from support.processes.compare_workers import invented

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.plan import Comparison, header_of
from marsupial.bench.compare.report import documents
from marsupial.bench.compare.statements import StatementVerdict
from marsupial.model.planning import Budget
from marsupial.papers.wurm2010 import experiment as wurm2010


@pytest.fixture(scope="module")
def paper() -> Comparison:
    return wurm2010.EXPERIMENT.comparison(runs=5, planner="greedy", budget=Budget(steps=1), maps=Path())


def paper_outcome(paper: Comparison, *, saved_s: float = 10.0, runs: int = 5, better: float = 0.5) -> ComparisonOutcome:
    """Return an outcome with these constant gains of temporal planning in time and quality."""
    rows = []
    for trial in paper.trials():
        if trial.seed > runs:
            break
        row = invented(trial).row
        ours = trial.contender == paper.contenders[0]
        time_s = 400.0 / trial.case.carriers + trial.seed - saved_s * ours
        quality = 2.0 + better * trial.case.carriers * ours + 0.01 * trial.seed
        rows.append(replace(row, exploration_time_s=time_s, quality=quality))
    return ComparisonOutcome(header_of(paper), tuple(rows))


def test_the_paper_s_experiment_has_its_teams_and_robots(paper: Comparison) -> None:
    assert len(list(paper.trials())) == 3 * 36 * 5
    assert [one.strategy for one in paper.contenders] == ["temporal", "wurm2010", "heuristic"]
    assert {case.scenario for case in paper.scenarios} == {"office", "maze"}
    for scenario in paper.scenarios.values():
        carrier, rover = scenario.robot_types
        assert carrier.speed_mps == 2 * rover.speed_mps
        assert carrier.sensor_range_m == 2 * rover.sensor_range_m


def test_statements_hold_where_the_data_say_so(paper: Comparison) -> None:
    found = wurm2010.findings(paper_outcome(paper))
    verdicts = [finding.verdict for finding in found]
    assert verdicts == [
        StatementVerdict.HOLDS,  # faster in all cases
        StatementVerdict.FAILS,  # 400/3 - 400/6 is 17 % of 400
        StatementVerdict.FAILS,  # office and maze are alike here
        StatementVerdict.HOLDS,
        StatementVerdict.HOLDS,
        StatementVerdict.HOLDS,
        StatementVerdict.HOLDS,
    ]
    assert "better in 18 of 18 cells" in found[0].evidence[0]


def test_statements_do_not_hold_where_the_data_say_the_opposite(paper: Comparison) -> None:
    found = wurm2010.findings(paper_outcome(paper, saved_s=-5.0, better=-0.1))
    assert found[0].verdict is StatementVerdict.FAILS
    assert "worse in 18" in found[0].evidence[0]
    assert [found[i].verdict for i in (3, 4, 5)] == [StatementVerdict.FAILS] * 3


def test_statements_are_open_without_enough_data(paper: Comparison) -> None:
    found = wurm2010.findings(paper_outcome(paper, runs=0))
    assert {finding.verdict for finding in found} == {StatementVerdict.OPEN}
    assert wurm2010.findings(paper_outcome(paper, runs=4))[0].verdict is StatementVerdict.OPEN


def test_the_paper_s_page_has_its_figures_and_the_checklist(paper: Comparison) -> None:
    written = dict(documents(paper_outcome(paper), wurm2010.EXPERIMENT))
    assert {"figures/figure-6.svg", "figures/figure-7.png", "checklist.md"} < written.keys()
    assert "**holds**: Temporal planning explores significantly faster" in written["checklist.md"].decode()
    text = written["report.html"].decode()
    assert text.count('class="verdict ') == 7
    assert "Each cell has 5 missions, the paper&#x27;s 30. With so few" in text
    assert "Eq. 2 is printed the other way round" in text
