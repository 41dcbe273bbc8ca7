from itertools import product

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from support.maps.drawn_maps import carrier
from support.maps.frontier_views import moment

from marsupial.arrays import Floats
from marsupial.model import FLOOR, UNKNOWN, Cell, CellArray, Grid, RobotType
from marsupial.papers.wurm2008.rules import Segments, assignment
from marsupial.papers.wurm2008.segmentation import segment
from marsupial.strategies.frontier.rule import Explorer, FrontierView

SLIM = carrier("slim", radius_m=0.15)
WIDE = carrier("wide", radius_m=0.6)


def floor_plan() -> CellArray:
    """Return a corridor of 12 m by 2 m with a room of 5.7 m by 4 m above each half, doors 0.9 m wide."""
    cells = np.zeros((62, 121), dtype=np.uint8)
    cells[1:21, 1:120] = FLOOR
    for left in (1, 61):
        cells[22:61, left : left + 58] = FLOOR
        cells[21, left + 20 : left + 29] = FLOOR
    return cells


LEFT_ROOM, RIGHT_ROOM = (slice(45, None), slice(0, 60)), (slice(45, None), slice(60, None))
CORRIDOR_END = (slice(0, 21), slice(105, None))


def view_of(robots: dict[str, tuple[RobotType, Cell]], *hidden: tuple[slice, slice]) -> FrontierView:
    cells = floor_plan()
    for box in hidden:
        cells[box] = UNKNOWN
    team = [Explorer(name=n, kind=k, cell=c, heading=0, goal=None) for n, (k, c) in robots.items()]
    return moment(Grid(cells=cells, resolution_m=0.1), team)


def places(view: FrontierView, rule: Segments | None = None) -> dict[str, str]:
    """Return the part of the floor plan that each robot is sent to."""
    names = {}
    for name, cell in (rule or Segments()).choose(view).items():
        x, y = cell % view.grid.width, cell // view.grid.width
        names[name] = "corridor" if y < 21 else "left" if x < 60 else "right"
    return names


def test_robots_side_by_side_go_to_different_rooms() -> None:
    robots = {"a": (SLIM, Cell(30, 10)), "b": (SLIM, Cell(33, 10))}
    assert places(view_of(robots, LEFT_ROOM, RIGHT_ROOM)) == {"a": "left", "b": "right"}


def test_a_robot_finishes_the_segment_that_it_is_in() -> None:
    robots = {"a": (SLIM, Cell(84, 21))}
    view = view_of(robots, RIGHT_ROOM, CORRIDOR_END)
    labels = segment(view.grid, frozenset({FLOOR}), view.frontiers["slim"].cells).labels
    inside = {"a": (SLIM, next(Cell(84, y) for y in range(18, 30) if labels[y, 84] == labels[40, 84]))}
    assert places(view_of(inside, RIGHT_ROOM, CORRIDOR_END)) == {"a": "right"}
    nearer = view_of(inside, RIGHT_ROOM, (slice(0, 21), slice(90, None)))
    assert places(nearer, Segments(discount=1.0)) == {"a": "corridor"}
    assert places(nearer, Segments(discount=0.1)) == {"a": "right"}


def test_a_robot_that_cannot_enter_a_segment_is_not_sent_there() -> None:
    robots = {"wide": (WIDE, Cell(30, 10)), "slim": (SLIM, Cell(90, 10))}
    assert places(view_of(robots, LEFT_ROOM, CORRIDOR_END)) == {"wide": "corridor", "slim": "left"}


def test_a_robot_that_can_enter_no_segment_is_left_out() -> None:
    robots = {"wide": (WIDE, Cell(30, 10)), "slim": (SLIM, Cell(90, 10))}
    assert places(view_of(robots, LEFT_ROOM)) == {"slim": "left"}


@pytest.mark.parametrize("count", [3, 4, 5])
def test_with_more_robots_than_segments_each_segment_has_its_share(count: int) -> None:
    robots = {f"r{k}": (SLIM, Cell(25 + 2 * k, 10)) for k in range(count)}
    found = list(places(view_of(robots, LEFT_ROOM, RIGHT_ROOM)).values())
    assert len(found) == count
    assert abs(found.count("left") - found.count("right")) <= count % 2


def test_robots_in_one_segment_share_out_its_frontiers() -> None:
    robots = {"a": (SLIM, Cell(50, 10)), "b": (SLIM, Cell(54, 10))}
    view = view_of(robots, (slice(0, 21), slice(0, 20)), (slice(0, 21), slice(100, None)))
    chosen = Segments().choose(view)
    assert chosen["a"] % view.grid.width < 30
    assert chosen["b"] % view.grid.width > 90


NO = np.inf
TABLES = st.tuples(st.integers(1, 5), st.integers(1, 3)).flatmap(
    lambda shape: arrays.arrays(np.float64, shape, elements=st.one_of(st.integers(0, 20), st.just(NO)))
)


@given(TABLES)
@example(np.array([[0.0, 0.0], [0.0, NO]]))
@example(np.array([[NO, 0.0, 9.0], [9.0, 0.0, 0.0], [NO, 1.0, 9.0], [NO, NO, NO]]))  # evenness costs two times nine
def test_assignments_are_the_best_of_all(costs: Floats) -> None:
    (rows, columns), found = costs.shape, assignment(costs)

    def worth(chosen: tuple[int, ...] | list[int]) -> tuple[int, int, float]:
        """Return the objective: number of unassigned rows, unevenness of the columns, cost."""
        used = [c for c in chosen if c >= 0]
        layers = sum(k for c in range(columns) for k in range(used.count(c)))
        return len(chosen) - len(used), layers, float(sum(costs[r, c] for r, c in enumerate(chosen) if c >= 0))

    copies = -(-rows // columns)
    possible = (
        choice
        for choice in product(range(-1, columns), repeat=rows)
        if all(c < 0 or np.isfinite(costs[r, c]) for r, c in enumerate(choice))
        and all(choice.count(c) <= copies for c in range(columns))
    )
    best = min(map(worth, possible))
    assert worth(found.tolist()) == best
