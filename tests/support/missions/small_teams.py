"""Drawn maps with point robots.

``#`` is an obstacle, ``.`` floor, ``,`` rough ground (for rovers only), ``?`` unknown even to the truth; the last line
of a drawing is row 0. A cell is 1 m. Carriers drive 1 m/s (a cell a second), rovers half that; carriers see 3 cells
far, rovers 2; docking takes 10 s, undocking 5 s.
"""

from collections.abc import Sequence

import numpy as np

from marsupial.model import MissionStarted
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, Grid
from marsupial.model.mission import PlacedRobot
from marsupial.model.robots import RobotType, Role
from marsupial.model.scenario import Goal

CODES = {"#": OBSTACLE, ".": FLOOR, ",": ROUGH, "?": UNKNOWN}
DOCK_MS, UNDOCK_MS = 10_000, 5_000

LONG_HALL = ("#" * 42, "#" + "." * 40 + "#", "#" * 42)
CORRIDOR = ("#########", "#.......#", "#########")
"""A hall, 7 cells long."""

ANNEX = ("###########", "#.........#", "####,######", "#,,,,,,,,,#", "###########")
"""A hall (y = 3) and, through a door at x = 4, rough ground along it (y = 1)."""

TWO_ANNEXES = ("#############", "#,,,,###,,,,#", "##,#######,##", "#...........#", "#############")
"""A hall (y = 1) with two rooms of rough ground (y = 3) behind doors at x = 2 and x = 10."""


def drawn_grid(*lines: str, resolution_m: float = 1.0) -> Grid:
    rows = [[CODES[char] for char in line] for line in reversed(lines)]
    return Grid(cells=np.array(rows, dtype=np.uint8), resolution_m=resolution_m)


def kinds_of(*, capacity: int = 1, carrier_range_m: float = 3.0, rover_range_m: float = 2.0) -> dict[str, RobotType]:
    carrier = RobotType(
        name="carrier",
        role=Role.CARRIER,
        speed_mps=1.0,
        sensor_range_m=carrier_range_m,
        radius_m=0.0,
        terrains=frozenset({FLOOR}),
        capacity=capacity,
    )
    rover = RobotType(
        name="rover",
        role=Role.ROVER,
        speed_mps=0.5,
        sensor_range_m=rover_range_m,
        radius_m=0.0,
        terrains=frozenset({FLOOR, ROUGH}),
        dock_ms=DOCK_MS,
        undock_ms=UNDOCK_MS,
    )
    return {"carrier": carrier, "rover": rover}


def begun_on(
    grid: Grid, kinds: Sequence[RobotType], robots: Sequence[PlacedRobot], *, goal: Goal | None = None
) -> MissionStarted:
    return MissionStarted(
        t_ms=0, scenario="drawn", strategy="temporal", planner="greedy", seed=1, width=grid.width, height=grid.height,
        resolution_m=grid.resolution_m, origin_m=grid.origin_m, terrains=grid.terrains, types=tuple(kinds),
        robots=tuple(robots), goal=goal or Goal(),
    )  # fmt: skip


def carrier_at(x: int, y: int, number: int = 1) -> PlacedRobot:
    """Return ``c<number>`` at a cell."""
    return PlacedRobot(name=f"c{number}", type="carrier", cell=Cell(x, y))


def rover_on(carrier: str, number: int = 1) -> PlacedRobot:
    """Return ``r<number>`` aboard a carrier."""
    return PlacedRobot(name=f"r{number}", type="rover", carrier=carrier)


def rover_at(x: int, y: int, number: int = 1) -> PlacedRobot:
    """Return ``r<number>`` at a cell."""
    return PlacedRobot(name=f"r{number}", type="rover", cell=Cell(x, y))
