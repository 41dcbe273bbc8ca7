from __future__ import annotations

import json
from dataclasses import replace

import pytest

from marsupial.bench import analysis
from marsupial.bench.analysis import AnalysisRow, analysis_row, bench_analysis, table, values
from marsupial.bench.attribution import CALLERS, REST

SIZE = 256


@pytest.fixture(scope="module")
def row() -> AnalysisRow:
    return analysis_row("rooms", SIZE, 1, 2)


def test_what_is_kept_comes_to_the_same_as_from_scratch(row: AnalysisRow) -> None:
    assert row.same
    assert row.targets > 0
    assert row.places > row.targets


def test_one_per_cent_of_the_map_is_revealed_each_time(row: AnalysisRow) -> None:
    assert row.revealed == round(0.01 * SIZE**2)


def test_parts_sum_up_to_the_whole(row: AnalysisRow) -> None:
    named = {part for part in analysis.PARTS.values() if part != CALLERS} | {REST}
    assert row.kept_parts.keys() == row.scratch_parts.keys() == named
    assert sum(row.kept_parts.values()) == pytest.approx(row.kept_s)
    assert sum(row.scratch_parts.values()) == pytest.approx(row.scratch_s)
    assert row.ratio == pytest.approx(row.scratch_s / row.kept_s)


def test_the_table_has_a_line_for_each_part_and_says_whether_both_came_to_the_same(row: AnalysisRow) -> None:
    lines = table([row, replace(row, same=False)]).splitlines()
    assert len(lines) == 3 + 2 * (len(row.kept_parts) + 2)
    assert [line.split()[2] for line in lines[3:5]] == ["footprints", "reach"]
    assert "in all" in lines[-2]
    assert "both come to the same" in lines[3 + len(row.kept_parts) + 1]
    assert lines[-1].endswith("both come to DIFFERENT situations")


def test_rows_are_json(row: AnalysisRow) -> None:
    (told,) = json.loads(json.dumps(values([row])))
    assert told["kept_parts"] == pytest.approx(row.kept_parts)
    assert (told["map"], told["size"], told["same"], told["ratio"]) == ("rooms", SIZE, True, pytest.approx(row.ratio))


def test_a_surveyor_that_missed_a_reveal_is_found_out() -> None:
    growing = analysis._Growing(analysis.generated("cave", SIZE, analysis.RESOLUTION_M, 1), 1)
    cells = growing.reveal()
    stale = growing.kept(cells[:0])
    assert not stale.says_what(growing.scratch())


def test_every_map_is_told_before_its_row() -> None:
    told: list[str] = []
    rows = [(row.map, row.size) for row in bench_analysis(sizes=(SIZE,), repeats=1, tell=told.append)]
    assert rows == [(name, SIZE) for name in analysis.MAPS]
    assert told[1:] == [f"{name}, {SIZE} x {SIZE} cells" for name in analysis.MAPS]
