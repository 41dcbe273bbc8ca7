"""Reports as they are stored, also by earlier versions."""

from __future__ import annotations

import pickle

import numpy as np

from marsupial_service.missions.frames import MissionFrame
from marsupial_service.missions.values import MissionReport


def test_a_report_comes_out_of_the_store_as_it_went_in_and_a_map_takes_little_of_it() -> None:
    cells = np.full((1000, 1000), 255, dtype=np.uint8)
    cells[200:700, 100:900] = 1
    report = MissionReport(n=3, t_ms=7, map=cells, robot="c", frame=MissionFrame(-1, 0, 1000, 1000))
    kept = pickle.dumps(report)
    again = pickle.loads(kept)
    assert (again.n, again.t_ms, again.robot, again.frame) == (3, 7, "c", report.frame)
    assert np.array_equal(again.map, cells)
    assert len(kept) < 20_000


def test_a_report_of_an_earlier_version_says_nothing_of_frames_or_whose_it_is() -> None:
    cells = np.ones((2, 2), dtype=np.uint8)
    again = MissionReport.__new__(MissionReport)
    again.__setstate__([3, 7, (("a", (0, 1, 1)),), cells, (), (4,), (), ()])
    assert (again.n, again.revealed, again.finished) == (3, (("a", (0, 1, 1)),), (4,))
    assert np.array_equal(again.map, cells)
    assert (again.robot, again.frame) == (None, None)
