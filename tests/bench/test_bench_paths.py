from __future__ import annotations

import numpy as np
import pytest

from marsupial.bench.paths import MAPS, PathsBench, bench_paths, grid_graph, table


@pytest.fixture(scope="module")
def result() -> PathsBench:
    return bench_paths(size=70, seed=3, repeats=1, cells=6)


def test_both_sides_agree_on_every_job(result: PathsBench):
    assert [(row.map, row.job) for row in result.rows] == [
        (name, job) for name in MAPS for job in ("field", "matrix K = 6", "corner to corner")
    ]
    assert all(row.difference < 1e-9 for row in result.rows)
    assert all(row.ratio == pytest.approx(row.scipy_s / row.ours_s) for row in result.rows)


def test_the_table_has_a_line_for_every_job_and_every_graph(result: PathsBench):
    lines = table(result).splitlines()
    assert len(lines) == 2 + len(result.rows) + 2 * len(MAPS)
    assert "max difference" in lines[1]
    assert "not counted" in lines[-1]


def test_energies_are_timed_beside_lengths_per_state(result: PathsBench):
    assert [row.map for row in result.energy] == list(MAPS)
    assert all(row.per_state == pytest.approx(row.energy_s / row.length_s / 8) for row in result.energy)
    assert "per state" in table(result)


def test_the_graph_has_no_step_that_cuts_a_corner():
    graph = grid_graph(np.array([[True, True], [True, False]])).toarray()
    assert graph.tolist() == [[0, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]


def test_every_room_can_be_entered():
    rooms = MAPS["rooms"](70, 5)
    assert not rooms[31].all()
    assert rooms[31, :31].sum() == 1
    assert rooms[:31, 31].sum() == 1
