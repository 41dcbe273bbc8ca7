"""The figures in README and docs are those of the stored results, which are complete and from proof maps."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support.processes.compare_workers import invented, lobby
from support.waiting import HANG_S

from benchmarks.figures import kept
from benchmarks.figures.blocks import PAGES, rebuilt
from benchmarks.figures.kept import ROOT, comparison, keep, printed, steady
from benchmarks.figures.picture import drawn, picture_file
from marsupial.bench.compare.arguments import cases_of
from marsupial.bench.compare.folder import opened
from marsupial.bench.compare.plan import Case, digest, header_of
from marsupial.bench.suite.maps import FOOTPRINT, PROOF, REAL_FOLDER
from marsupial.errors import UsageError
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial.papers import experiment

COMPARED = [file.parent.name for file in sorted(kept.ROWS.glob("*/rows.csv.gz"))]


@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page_are_those_of_the_kept_results(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert text == rebuilt(text), "`make figures` writes them anew"


def test_the_picture_is_that_of_the_kept_results() -> None:
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", drawn(comparison("footprint")))
    assert re.findall(r"<text[^>]*>([^<]*)</text>", picture_file("footprint").read_text(encoding="utf-8")) == texts
    assert {"all", "spiral", "assignment", "40 %"} <= set(texts)


def test_a_figure_changed_by_hand_does_not_stay() -> None:
    text = (ROOT / "docs" / "comparisons.md").read_text(encoding="utf-8")
    changed = text.replace(" s of CPU time", "9 s of CPU time")
    assert rebuilt(changed) == text != changed


def scenarios_of(paper: str | None, suite: str) -> dict[Case, Scenario]:
    """Return the scenarios of a paper, or of the first maps of a suite, which are of different kinds."""
    if paper is None:
        return cases_of(PROOF[suite].sources()[: len(FOOTPRINT)], (2, 4), (2,), print)
    asked = experiment(paper).comparison(runs=1, planner="anytime", budget=Budget(steps=8), maps=REAL_FOLDER)
    return dict(asked.scenarios)


@pytest.mark.parametrize("name", COMPARED)
def test_a_kept_comparison_has_all_its_missions_on_maps_that_nothing_was_tuned_on(name: str) -> None:
    found = comparison(name)
    assert len(found.rows) == len(found.timings) == found.planned
    if not (found.header["paper"] or found.header.get("suite")):
        return  # a worked example, which claims nothing
    try:
        scenarios = scenarios_of(found.header["paper"], found.header.get("suite", ""))
    except UsageError as error:  # maps of real buildings
        pytest.skip(str(error))
    before = {Case(one["scenario"], one["carriers"], one["rovers"]): one for one in found.header["cases"]}
    for case, scenario in scenarios.items():
        apart = before[case].get("interference", False)
        assert digest(replace(scenario, interference=apart)) == before[case]["digest"]


def test_stored_comparisons_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "ROWS", tmp_path / "rows")
    results = [invented(trial) for trial in lobby().trials()]
    with opened(tmp_path, header_of(lobby())) as add:
        for result in results:
            add(result)
    keep("small", "0123456789", "", tmp_path)
    found = comparison("small")
    assert found.header == header_of(lobby())
    assert found.rows == tuple(result.row for result in results)
    assert found.timings == tuple(result.timing for result in results)
    assert "not carried out yet" in rebuilt("<!-- figures: footprint results -->\n<!-- end -->").lower()


@pytest.mark.parametrize("block", ["footprnt results", "footprint wins"])
def test_an_unknown_block_is_refused(block: str) -> None:
    with pytest.raises(UsageError, match=r"unknown .*footprnt|unknown .*wins"):
        rebuilt(f"<!-- figures: {block} -->\n<!-- end -->")


@pytest.mark.slow
def test_the_demo_prints_what_is_kept(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "marsupial", "demo", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=HANG_S, check=True)
    assert steady(done.stdout) == printed("demo")
