from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import marsupial
from marsupial.bench.attribution import CALLERS, REST, Callers, Function, Profile, profiled
from marsupial.model.grid import Cell
from marsupial.paths.fields import PathSearch

PARTS = {
    "maps": "analysis",
    "maps.sight": CALLERS,
    "sim": "sensing",
    "planning": "planning",
    "planning.checker": "checking",
}

ROOT = Path(marsupial.__file__).parent


def ours(module: str) -> Function:
    return str(ROOT.joinpath(*module.split(".")).with_suffix(".py")), 1, "work"


def library(name: str) -> Function:
    return "/elsewhere/numpy/lib.py", 1, name


def entry(own_s: float, callers: Callers | None = None, calls: int = 1) -> tuple[int, int, float, float, Callers]:
    return calls, calls, own_s, own_s, callers or {}


def called(seconds: float) -> tuple[int, int, float, float]:
    return 1, 1, seconds, seconds


def test_a_function_counts_for_the_longest_name_that_fits_its_module() -> None:
    stats = {ours("planning.checker"): entry(1.0), ours("planning.race"): entry(3.0)}
    shares = Profile(stats, PARTS).shares(4.0)
    assert shares == {"analysis": 0.0, "sensing": 0.0, "planning": 0.75, "checking": 0.25, REST: 0.0}


def test_what_belongs_to_no_part_counts_for_those_who_called_it() -> None:
    stats = {
        ours("maps.survey"): entry(1.0),
        ours("sim.world"): entry(1.0),
        ours("maps.sight"): entry(4.0, {ours("sim.world"): called(3.0), ours("maps.survey"): called(1.0)}),
        library("unique"): entry(2.0, {ours("maps.sight"): called(2.0)}),
        library("alone"): entry(2.0),
    }
    shares = Profile(stats, PARTS).shares(10.0)
    assert shares["sensing"] == pytest.approx((1.0 + 3.0 + 1.5) / 10)
    assert shares["analysis"] == pytest.approx((1.0 + 1.0 + 0.5) / 10)
    assert shares[REST] == pytest.approx(0.2)


def test_functions_that_call_each_other_count_for_who_called_the_first() -> None:
    stats = {
        ours("sim.world"): entry(1.0),
        library("there"): entry(1.0, {ours("sim.world"): called(0.5), library("back"): called(0.5)}),
        library("back"): entry(1.0, {library("there"): called(1.0)}),
    }
    assert Profile(stats, PARTS).shares(3.0)["sensing"] == pytest.approx(1.0)


def test_what_profiling_takes_for_each_call_is_taken_off() -> None:
    stats = {ours("sim.world"): entry(3.0, calls=10), ours("maps.survey"): entry(12.0, calls=90)}
    shares = Profile(stats, PARTS).shares(5.0)
    assert shares["sensing"] == pytest.approx(2.0 / 5.0)
    assert shares["analysis"] == pytest.approx(3.0 / 5.0)


def test_a_job_is_carried_out_and_its_time_told_by_part() -> None:
    search = PathSearch(np.ones((200, 200), dtype=np.bool_))
    fields, parts = profiled(
        lambda: [search.field(Cell(x, 3)) for x in range(20)], {"paths": "ways", "sim": "sim"}, 2.0
    )
    assert fields[7][3, 9] == 2.0
    assert sum(parts.values()) == pytest.approx(2.0)
    assert parts.keys() == {"ways", "sim", REST}
    assert parts["sim"] == 0.0
    assert parts["ways"] > parts[REST]
