from __future__ import annotations

import json

import numpy as np
import pytest

from marsupial.bench import paths
from marsupial.bench.drawn import MASKS
from marsupial.bench.paths import C_BUCKETS, C_HEAP, SCIPY, PathsBench, bench_paths, grid_graph
from marsupial.bench.paths_report import table, values
from marsupial.bench.reference.compiled import NotCompiled, compiled

JOBS = ("field", "matrix K = 6", "corner to corner")
SIZES = (70, 90)
PLAIN = () if isinstance(compiled("dijkstra"), NotCompiled) else (C_HEAP, C_BUCKETS)


@pytest.fixture(scope="module")
def result() -> PathsBench:
    return bench_paths(sizes=SIZES, seed=3, repeats=1, cells=6)


def test_all_sides_agree_on_every_job(result: PathsBench):
    assert [(row.size, row.map, row.job, row.reference) for row in result.rows] == [
        (size, name, job, reference)
        for size in SIZES
        for name in MASKS
        for job in JOBS
        for reference in (*PLAIN, SCIPY)
    ]
    assert all(row.difference < 1e-9 for row in result.rows)
    assert all(row.ratio == pytest.approx(row.reference_s / row.ours_s) for row in result.rows)


def test_the_table_has_a_line_for_every_job_and_every_graph(result: PathsBench):
    lines = table(result).splitlines()
    assert len(lines) == 3 + len(SIZES) * len(MASKS) * (len(JOBS) + 2) + (not PLAIN)
    assert max(map(len, lines)) <= 100
    assert "off by" in lines[2]
    assert all(name in lines[2] for name in (C_HEAP, C_BUCKETS, SCIPY))
    assert "not counted" in table(result)


def test_energies_are_timed_beside_lengths_per_state(result: PathsBench):
    assert [(row.size, row.map) for row in result.energy] == [(size, name) for size in SIZES for name in MASKS]
    assert all(row.per_state == pytest.approx(row.energy_s / row.length_s / 8) for row in result.energy)
    assert "per state" in table(result)


def test_rows_are_flat_json(result: PathsBench):
    rows = json.loads(json.dumps(values(result)))
    assert len(rows) == len(result.rows)
    assert rows[0]["ratio"] == pytest.approx(result.rows[0].ratio)
    assert (rows[0]["map"], rows[0]["size"], rows[0]["seed"]) == ("rand20", 70, 3)


def test_without_a_compiler_c_is_left_out_with_the_reason(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(paths, "compiled", lambda name: NotCompiled("there is no compiler (cc)"))
    alone = bench_paths(sizes=(64,), repeats=1, cells=3)
    assert {row.reference for row in alone.rows} == {SCIPY}
    assert table(alone).splitlines()[-1] == "C is left out: there is no compiler (cc)"


def test_the_graph_has_no_step_that_cuts_a_corner():
    graph = grid_graph(np.array([[True, True], [True, False]])).toarray()
    assert graph.tolist() == [[0, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]


def test_every_room_can_be_entered():
    rooms = MASKS["rooms"](70, 5)
    assert not rooms[31].all()
    assert rooms[31, :31].sum() == 1
    assert rooms[:31, 31].sum() == 1


@pytest.mark.parametrize("name", MASKS)
def test_the_same_seed_draws_the_same_map_of_the_size_asked_for(name: str):
    first, again, other = (MASKS[name](100, seed) for seed in (5, 5, 6))
    assert first.shape == (100, 100)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
