from itertools import pairwise

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from marsupial.model.grid import Mask
from marsupial_service.analyses.analysis import Ring, polygons

MASKS = arrays.arrays(np.bool_, st.tuples(st.integers(1, 7), st.integers(1, 7)))


def area(ring: Ring) -> float:
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairwise(ring)) / 2


def holds(ring: Ring, x: float, y: float) -> bool:
    return sum(ax == bx and (ay > y) != (by > y) and x < ax for (ax, ay), (bx, by) in pairwise(ring)) % 2 == 1


def test_a_ring_has_a_corner_where_it_turns_only() -> None:
    assert polygons(np.ones((2, 3), dtype=np.bool_)) == [[[(0, 0), (3, 0), (3, 2), (0, 2), (0, 0)]]]


@given(mask=MASKS)
@example(mask=np.maximum(*abs(np.indices((7, 7)) - 3)) % 2 == 1)  # a ring in a ring
def test_a_cell_is_in_a_polygon_just_if_it_is_in_the_mask(mask: Mask) -> None:
    found = polygons(mask)
    for y, x in np.ndindex(*mask.shape):
        covered = [
            p for p in found if holds(p[0], x + 0.5, y + 0.5) and not any(holds(h, x + 0.5, y + 0.5) for h in p[1:])
        ]
        assert len(covered) == mask[y, x]
    for outer, *holes in found:
        assert outer[0] == outer[-1]
        assert area(outer) > 0
        assert all(area(hole) < 0 for hole in holes)
