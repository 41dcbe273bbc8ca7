from __future__ import annotations

import numpy as np

from marsupial.cli.thumbnail import Mark, thumbnail
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN


def styles(cells: list[list[int]], *marks: Mark, columns: int = 80, rows: int = 40) -> list[str]:
    text = thumbnail(np.array(cells, dtype=np.uint8), marks, columns, rows)
    return [str(span.style) for span in text.spans]


def test_the_row_at_the_top_of_the_grid_is_drawn_first() -> None:
    assert styles([[FLOOR], [OBSTACLE]]) == ["grey35 on grey74"]


def test_a_robot_hides_the_floor_and_a_carrier_hides_a_rover() -> None:
    assert styles([[FLOOR], [FLOOR]], Mark(0, 1, True), Mark(0, 1, False)) == ["cyan1 on grey74"]


def test_an_odd_row_is_filled_up() -> None:
    assert styles([[FLOOR]]) == ["grey74 on grey15"]


def test_a_large_map_fits_into_the_space_there_is() -> None:
    text = thumbnail(np.full((100, 300), UNKNOWN, dtype=np.uint8), [], 60, 20)
    lines = text.plain.split("\n")
    assert len(lines) <= 20
    assert max(map(len, lines)) <= 60


def test_a_wall_shows_among_floor_when_shrunk() -> None:
    assert styles([[FLOOR, OBSTACLE], [FLOOR, FLOOR]], columns=1, rows=1) == ["grey35 on grey15"]
