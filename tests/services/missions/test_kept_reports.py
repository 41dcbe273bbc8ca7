"""Briefs and inputs as they are stored."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from mission_setup import brief

from marsupial.model.grid import Cell
from marsupial.model.missionframe import MissionFrame
from marsupial.model.robots import EnergyModel
from marsupial.model.runs import drawn, known_runs
from marsupial_service.missions.encoding import decode_brief, decode_input, encode_brief, encode_input
from marsupial_service.missions.values import Control, Input, MissionBrief, MissionReport, RobotSimulation


def plain(value: Any) -> Any:
    """Return the fields of a value with arrays, for comparisons."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, MissionBrief | RobotSimulation) or hasattr(value, "cells"):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    return value


STORED = b"""\
{"n":3,"robot":"c","t_ms":7,"revealed":[{"robot":"c","runs":[4,2,1]}],\
"robots":[{"name":"c","cell":[1,2],"distance_m":0.5,"driving_ms":20},{"name":"r","free_at_ms":9}],\
"finished":[4],"failed":[{"id":5,"reason":"stuck"}],"lost":[{"robot":"r","reason":"battery"}],\
"frame":{"x":-1,"y":0,"width":10,"height":20}}"""
REPORT = MissionReport(
    n=3,
    t_ms=7,
    revealed=[{"robot": "c", "runs": (4, 2, 1)}],
    finished=[4],
    failed=[{"id": 5, "reason": "stuck"}],
    lost=[{"robot": "r", "reason": "battery"}],
    robot="c",
    robots=[{"name": "c", "cell": Cell(1, 2), "distance_m": 0.5, "driving_ms": 20}, {"name": "r", "free_at_ms": 9}],
    frame=MissionFrame(-1, 0, 10, 20),
)


@pytest.mark.parametrize(
    ("given", "stored"),
    [
        (REPORT, STORED),
        (MissionReport(n=3, t_ms=7), b'{"n":3,"t_ms":7}'),
        *((control, f'"{control}"'.encode()) for control in Control),
    ],
)
def test_an_input_is_stored_as_json_without_class_names(given: Input, stored: bytes) -> None:
    assert encode_input(given) == stored
    assert decode_input(stored) == given


def test_a_stored_map_is_compact_and_reads_back_unchanged() -> None:
    cells = np.full((1000, 1000), 255, dtype=np.uint8)
    cells[200:700, 100:900] = 1
    report = MissionReport(n=3, t_ms=7, map={"runs": known_runs(cells)})
    kept = encode_input(report)
    again = decode_input(kept)
    assert isinstance(again, MissionReport)
    assert again.map is not None
    assert np.array_equal(drawn(again.map.runs, cells.shape), cells)
    assert len(kept) < 20_000


def test_a_stored_brief_reads_back_unchanged() -> None:
    sent = brief()
    cells = sent.grid.cells.copy()
    cells[3, 4:9] = 1
    known = replace(sent, grid=replace(sent.grid, cells=cells))
    for one in (sent, replace(known, reachable=None)):
        assert plain(decode_brief(encode_brief(one))) == plain(one)
    simulated = replace(known, simulation=RobotSimulation(truth=known_runs(cells), speed=None, warnings=("small",)))
    assert plain(decode_brief(encode_brief(simulated))) == plain(simulated)


def test_all_processes_of_a_mission_write_the_same_numbers() -> None:
    energy = EnergyModel(idle_w=20)  # as built for a client that omits the other fields
    sent = replace(brief(), kinds=tuple(replace(kind, energy=energy) for kind in brief().kinds))
    first = decode_brief(encode_brief(sent))
    assert encode_brief(decode_brief(encode_brief(first))) == encode_brief(first)
