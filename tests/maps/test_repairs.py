import numpy as np
import pytest
from support.missions.small_teams import drawn_grid

from marsupial.errors import MapError
from marsupial.maps.repairs import closed, find_specks, painted, without_specks
from marsupial.model.grid import FLOOR, ROUGH, UNKNOWN

GRID = drawn_grid(
    "...........",
    ".?...??..,,",
    "......?..,?",
    "?..##....,,",
    "...#?......",
    ".......??..",
    "?..?...??..",
    "...........",
)
"""Four specks, of 1, 1, 3 and 4 cells; unknown cells at walls and at the border are not specks."""


def test_specks_are_groups_of_unknown_cells_with_free_ground_all_round() -> None:
    specks = find_specks(GRID)
    assert specks.number == 4
    assert len(specks.cells) == 1 + 3 + 4 + 1
    assert (GRID.cells.ravel()[specks.cells] == UNKNOWN).all()
    assert 4 + 3 * GRID.width not in specks.cells
    assert not {0, GRID.width - 1} & set((specks.cells % GRID.width).tolist())


def test_the_smaller_ones_are_chosen_by_their_cells() -> None:
    specks = find_specks(GRID)
    assert [specks.smaller(cells).number for cells in (1, 2, 4, 5)] == [0, 2, 3, 4]


def test_they_are_painted_as_the_ground_beside_them() -> None:
    grid = drawn_grid("....,,,,,", ".??.,???,", ".??.,,,,,", ".........")
    cells = painted(grid, find_specks(grid))
    assert UNKNOWN not in cells
    assert (np.unique(cells[:, 1:3]).tolist(), np.unique(cells[2, 5:8]).tolist()) == ([FLOOR], [ROUGH])


def test_a_map_without_any_stays_as_it_is() -> None:
    grid = drawn_grid("...", "?#.", "...")
    assert (painted(grid, find_specks(grid)) == grid.cells).all()


def test_specks_of_obstacle_go_too_and_walls_and_what_is_as_large_as_a_robot_stay() -> None:
    grid = drawn_grid("#########", "#.......#", "#.#...?.#", "#....##.#", "#.#..##.#", "#.......#", "#########")
    cleaned, number = without_specks(grid, 2)
    assert number == 2  # the block is larger, and unknown ground beside an obstacle is no speck
    kept = drawn_grid("#########", "#.......#", "#.....?.#", "#....##.#", "#....##.#", "#.......#", "#########")
    assert (cleaned.cells == kept.cells).all()


def test_ground_beyond_the_walls_is_unknown_and_openings_are_walled_up() -> None:
    grid = drawn_grid(".......", ".##.##.", ".#...#.", ".....#.", ".#####.", ".......")
    bounded = drawn_grid("???????", "?#####?", "?#...#?", "?#...#?", "?#####?", "???????")
    np.testing.assert_array_equal(closed(grid).cells, bounded.cells)


@pytest.mark.parametrize("lines", [("...", "..."), ("....", "####", "....")])
def test_obstacles_that_enclose_nothing_give_no_boundary(lines: tuple[str, ...]) -> None:
    with pytest.raises(MapError, match="enclose no area"):
        closed(drawn_grid(*lines))
