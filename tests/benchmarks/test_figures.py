"""The figures in README and docs: they are those of the kept results, which are whole and of maps for claims."""

import subprocess
import sys
from pathlib import Path

import pytest
from compare_workers import invented, lobby
from patience import HANG_S

from benchmarks.figures import kept
from benchmarks.figures.blocks import PAGES, rebuilt
from benchmarks.figures.kept import COMMANDS, ROOT, comparison, keep, printed, steady
from marsupial.bench.compare.folder import opened
from marsupial.bench.compare.plan import digest, header_of
from marsupial.bench.suite.maps import PROOF
from marsupial.cli.work.compare_arguments import cases_of
from marsupial.errors import UsageError

COMPARED = [name for name, command in COMMANDS.items() if command.startswith("compare ")]


@pytest.mark.parametrize("page", PAGES)
def test_the_blocks_of_a_page_are_those_of_the_kept_results(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert text == rebuilt(text), "`make figures` writes them anew"


def test_a_figure_changed_by_hand_does_not_stay() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    _, figure, _ = text.partition("+6.2 [")
    assert figure
    assert rebuilt(text.replace("+6.2 [", "+9.9 [")) == text


@pytest.mark.parametrize("name", COMPARED)
def test_a_kept_comparison_has_all_its_missions_on_maps_that_nothing_was_tuned_on(name: str) -> None:
    found = comparison(name)
    assert len(found.rows) == len(found.timings) == found.planned
    assert found.header["suite"] in (None, *PROOF)


@pytest.mark.parametrize("name", COMPARED)
def test_the_first_map_of_each_kind_is_still_the_one_of_the_kept_missions(name: str) -> None:
    cases = {case["scenario"].rpartition("-")[0]: case for case in reversed(comparison(name).header["cases"])}
    for case in cases.values():
        (scenario,) = cases_of([case["scenario"]], (case["carriers"],), (case["rovers"],)).values()
        assert digest(scenario) == case["digest"]


def test_what_is_kept_of_a_comparison_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


@pytest.mark.parametrize("block", ["footprnt losses", "footprint wins"])
def test_an_unknown_block_is_refused(block: str) -> None:
    with pytest.raises(UsageError, match=r"unknown .*footprnt|unknown .*wins"):
        rebuilt(f"<!-- figures: {block} -->\n<!-- end -->")


@pytest.mark.slow
def test_the_demo_prints_what_is_kept(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "marsupial", "demo", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=HANG_S, check=True)
    assert steady(done.stdout) == printed("demo")
