"""Worlds of cells, in which robots hop from cell to cell and see the cells around them."""

from __future__ import annotations

from marsupial.bench.papers.teams import explorers
from marsupial.generators.papers import scattered
from marsupial.model.grid import FLOOR
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import Scenario

CELLS = 25
"""Columns and rows of most worlds of Al-Khawaldah et al."""

SEED = 1
"""Of the obstacles' places."""

HOPPER = RobotType(
    name="robot",
    role=Role.CARRIER,
    speed_mps=1.0,
    sensor_range_m=1.5,
    radius_m=0.0,
    terrains=frozenset({FLOOR}),
    diagonal=1.0,
)
"""Sees its eight neighbours; each move takes a second."""


def cell_world(name: str, columns: int, rows: int, obstacles: int, robots: int) -> Scenario:
    """Return the scenario of that many robots in a world of cells of 1 m, some of which are obstacles."""
    return explorers(name, scattered(columns, rows, obstacles, SEED), HOPPER, robots)
