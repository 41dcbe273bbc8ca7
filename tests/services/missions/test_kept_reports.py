"""Reports as they are stored."""

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
