import numpy as np
import pytest
from hypothesis import given
from support.maps.drawn_maps import random_cells

from marsupial.maps.reach import parts
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, CellArray, Grid
from marsupial.papers.wurm2008.segmentation import Segmentation, segment

FLOORS = frozenset({FLOOR})
CODES = (OBSTACLE, FLOOR, FLOOR, FLOOR, UNKNOWN)


def frontier_of(cells: CellArray) -> np.ndarray:
    unknown = np.pad(cells == UNKNOWN, 1)
    beside = unknown[:-2, 1:-1] | unknown[2:, 1:-1] | unknown[1:-1, :-2] | unknown[1:-1, 2:]
    return np.flatnonzero((cells == FLOOR) & beside)


def segments_of(cells: CellArray, resolution_m: float = 0.1, *, explored: bool = False) -> Segmentation:
    grid = Grid(cells=cells, resolution_m=resolution_m)
    return segment(grid, FLOORS, None if explored else frontier_of(cells))


def floor_plan() -> CellArray:
    """Return a corridor 2 m wide, 12 m long, with two rooms of 5.7 m by 4 m on either side, doors 0.9 m wide."""
    cells = np.zeros((102, 121), dtype=np.uint8)
    cells[41:61, 1:120] = FLOOR
    for left in (1, 61):
        for bottom in (1, 62):
            cells[bottom : bottom + 39, left : left + 58] = FLOOR
        door = slice(left + 20, left + 29)
        cells[40, door] = cells[61, door] = FLOOR
    return cells


def with_unknown(cells: CellArray, *boxes: tuple[slice, slice]) -> CellArray:
    seen = cells.copy()
    for box in boxes:
        seen[box] = UNKNOWN
    return seen


UPPER_LEFT = (slice(75, None), slice(0, 60))
LOWER_RIGHT = (slice(0, 25), slice(60, None))
CORRIDOR_END = (slice(41, 61), slice(100, None))


def at(found: Segmentation, x: int, y: int) -> int:
    return int(found.labels[y, x])


def test_rooms_and_corridor_are_segments() -> None:
    found = segments_of(floor_plan(), explored=True)
    assert (found.count, len(found.critical)) == (5, 4)
    rooms = [at(found, x, y) for x in (10, 110) for y in (10, 90)]
    assert len({*rooms, at(found, 60, 50)}) == 5
    assert at(found, 5, 50) == at(found, 115, 50)


def test_segments_meet_in_the_doorways() -> None:
    found = segments_of(floor_plan(), explored=True)
    for x, y in ((25, 36), (25, 65), (85, 36), (85, 65)):
        assert at(found, x, y) != at(found, x, 50)
    for x in (25, 85):
        assert at(found, x, 45) == at(found, x, 57) == at(found, x, 50)


@pytest.mark.parametrize(
    ("hidden", "rooms"),
    [
        ((UPPER_LEFT,), [(10, 70)]),
        ((UPPER_LEFT, LOWER_RIGHT), [(10, 70), (110, 30)]),
        ((UPPER_LEFT, LOWER_RIGHT, CORRIDOR_END), [(10, 70), (110, 30)]),
        ((CORRIDOR_END,), []),
    ],
)
def test_unexplored_ground_has_separate_segments(
    hidden: tuple[tuple[slice, slice], ...], rooms: list[tuple[int, int]]
) -> None:
    cells = with_unknown(floor_plan(), *hidden)
    found = segments_of(cells)
    unexplored = {at(found, x, y) for x, y in rooms} | ({at(found, 90, 50)} if CORRIDOR_END in hidden else set())
    assert set(found.labels.ravel()[frontier_of(cells)].tolist()) == unexplored
    assert len(unexplored) == len(hidden)
    if CORRIDOR_END not in hidden:
        assert found.count == 1 + len(rooms) == 1 + len(found.critical)
        assert at(found, 10, 10) == at(found, 60, 50)


def test_a_map_without_narrow_places_is_one_segment() -> None:
    cells = np.zeros((60, 90), dtype=np.uint8)
    cells[1:-1, 1:-1] = FLOOR
    assert segments_of(cells, explored=True).count == 1
    assert segments_of(with_unknown(cells, (slice(None), slice(50, None)))).count == 1


def test_a_map_of_which_nothing_is_known_has_no_segment() -> None:
    found = segments_of(np.full((6, 5), UNKNOWN, dtype=np.uint8))
    assert found.count == 0
    assert not found.labels.any()


@given(cells=random_cells(codes=CODES, largest=30))
def test_every_drivable_cell_has_one_segment_of_what_it_is_connected_to(cells: CellArray) -> None:
    found = segments_of(cells)
    assert ((found.labels > 0) == (cells == FLOOR)).all()
    assert set(np.unique(found.labels).tolist()) - {0} == set(range(1, found.count + 1))
    connected, count = parts(cells == FLOOR)
    homes = {(int(s), int(p)) for s, p in zip(found.labels.ravel(), connected.ravel(), strict=True) if s}
    assert len(homes) == found.count
    if not len(found.critical):
        assert found.count == count


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_floor_plan_that_is_turned_has_the_same_segments(turns: int) -> None:
    for cells in (floor_plan(), with_unknown(floor_plan(), UPPER_LEFT, LOWER_RIGHT, CORRIDOR_END)):
        explored = not (cells == UNKNOWN).any()
        straight = segments_of(cells, explored=explored)
        turned = segments_of(np.ascontiguousarray(np.rot90(cells, turns)), explored=explored)
        assert turned.count == straight.count
        assert len(turned.critical) == len(straight.critical)
