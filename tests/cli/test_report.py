from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from marsupial.cli.display.report import remaining_lines
from marsupial.model.grid import Cell
from marsupial.model.mission import Remaining


def test_frontiers_that_are_left_are_counted_by_their_reasons() -> None:
    alone = Remaining(cell=Cell(3, 4), frontier_cells=1, reason="too narrow")
    two = [Remaining(cell=Cell(5, 6), frontier_cells=n, reason="no way") for n in (2, 3)]
    summary: Any = SimpleNamespace(remaining=(alone, *two))
    assert remaining_lines(summary) == [
        "left: a frontier of 1 cell at (3, 4): too narrow",
        "left: 2 frontiers of 5 cells, as at (5, 6): no way",
    ]
