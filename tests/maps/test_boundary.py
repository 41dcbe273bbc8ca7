import numpy as np
import pytest
from small_missions import drawn_grid

from marsupial.errors import MapError
from marsupial.maps.repairs import closed


def test_ground_beyond_the_walls_is_unknown_and_openings_are_walled_up() -> None:
    grid = drawn_grid(".......", ".##.##.", ".#...#.", ".....#.", ".#####.", ".......")
    bounded = drawn_grid("???????", "?#####?", "?#...#?", "?#...#?", "?#####?", "???????")
    np.testing.assert_array_equal(closed(grid).cells, bounded.cells)


@pytest.mark.parametrize("lines", [("...", "..."), ("....", "####", "....")])
def test_obstacles_that_enclose_nothing_give_no_boundary(lines: tuple[str, ...]) -> None:
    with pytest.raises(MapError, match="enclose no area"):
        closed(drawn_grid(*lines))
