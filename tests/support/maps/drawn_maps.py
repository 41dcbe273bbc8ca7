"""Maps drawn as rows of text, top row first, and robots for them; a cell is one metre by default."""

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from marsupial.model import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Mask, PlacedRobot, RobotType, Role

CODES = {"#": OBSTACLE, ".": FLOOR, ",": ROUGH, "?": UNKNOWN}
ONE_DOOR = (
    "#########?#",
    "#.........#",
    "#.........#",
    "#.........#",
    "####.######",
    "#.........#",
    "#.c.......#",
    "#.........#",
    "###########",
)
"""Two rooms with a door that only rovers fit through; one cell of the wall is unknown."""


def draw(*rows: str, resolution_m: float = 1.0) -> Grid:
    """Return the grid of a drawing; any letter not in `CODES` stands on floor."""
    cells = [[CODES.get(sign, FLOOR) for sign in row] for row in reversed(rows)]
    return Grid(cells=np.array(cells, dtype=np.uint8), resolution_m=resolution_m)


def where(sign: str, *rows: str) -> list[Cell]:
    """Return the cells where a drawing has that character."""
    return [Cell(x, y) for y, row in enumerate(reversed(rows)) for x, found in enumerate(row) if found == sign]


def picture(mask: Mask) -> list[str]:
    """Return a mask as rows of text: ``x`` for true, ``.`` for false."""
    return ["".join("x" if cell else "." for cell in row) for row in mask[::-1]]


def mask_of(*rows: str) -> Mask:
    return np.array([[sign == "x" for sign in row] for row in reversed(rows)], dtype=np.bool_)


def on_map(indices: npt.NDArray[np.int64], grid: Grid) -> Mask:
    """Return row-major indices as a mask."""
    mask = np.zeros(grid.cells.shape, dtype=np.bool_)
    mask.ravel()[indices] = True
    return mask


def carrier(name: str = "carrier", *, radius_m: float = 1.2, range_m: float = 8.0, capacity: int = 2) -> RobotType:
    """Return a carrier type; its default radius covers its own cell and the four around it."""
    return RobotType(
        name=name, role=Role.CARRIER, speed_mps=1.0, sensor_range_m=range_m, radius_m=radius_m,
        terrains=frozenset({FLOOR}), capacity=capacity,
    )  # fmt: skip


def rover(name: str = "rover", *, radius_m: float = 0.2, range_m: float = 4.0) -> RobotType:
    """Return a rover type; its default radius covers only its own cell."""
    return RobotType(
        name=name, role=Role.ROVER, speed_mps=0.5, sensor_range_m=range_m, radius_m=radius_m,
        terrains=frozenset({FLOOR, ROUGH}), dock_ms=10_000, undock_ms=5_000,
    )  # fmt: skip


def standing(name: str, cell: Cell, kind: str = "carrier") -> PlacedRobot:
    return PlacedRobot(name=name, type=kind, cell=cell)


def aboard(name: str, carrier: str, kind: str = "rover") -> PlacedRobot:
    return PlacedRobot(name=name, type=kind, carrier=carrier)


@st.composite
def random_cells(
    draw: st.DrawFn, codes: tuple[int, ...] = (OBSTACLE, FLOOR, FLOOR, ROUGH), smallest: int = 1, largest: int = 12
) -> CellArray:
    """Draw the codes of a small map's cells, with a varying share of obstacles."""
    height, width = draw(st.integers(smallest, largest)), draw(st.integers(smallest, largest))
    flat = draw(st.lists(st.sampled_from(codes), min_size=height * width, max_size=height * width))
    return np.array(flat, dtype=np.uint8).reshape(height, width)


@st.composite
def random_flags(draw: st.DrawFn, shape: tuple[int, int]) -> Mask:
    size = shape[0] * shape[1]
    return np.array(draw(st.lists(st.booleans(), min_size=size, max_size=size)), dtype=np.bool_).reshape(shape)
