import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import carrier, draw, where
from support.maps.frontier_views import moment

from marsupial.maps.targets import Frontier
from marsupial.papers.mei2006.rules import Orientation, WidestFrontier, clockwise
from marsupial.strategies.frontier.rule import Explorer, FrontierView

NORTH, EAST, SOUTH, WEST = 2, 0, 6, 4


def view_of(*rows: str, heading: int | None = NORTH, range_m: float = 10.0, goal: int | None = None) -> FrontierView:
    """Return the moment of a drawing: `R` is the robot, `f` are the frontier cells."""
    grid = draw(*rows)
    cells = np.array(sorted(cell.y * grid.width + cell.x for cell in where("f", *rows)), dtype=np.int64)
    kind = carrier("robot", radius_m=0.0, range_m=range_m)
    robot = Explorer(name="r", kind=kind, cell=where("R", *rows)[0], heading=heading, goal=goal)
    return moment(grid, [robot], {"robot": Frontier(cells=cells, viewpoints=cells)})


def xy(view: FrontierView, cells: Sequence[int] | np.ndarray) -> list[tuple[int, int]]:
    return [tuple(view.cell(int(cell))) for cell in cells]


def went(rule: Orientation | WidestFrontier, view: FrontierView) -> list[tuple[int, int]]:
    return xy(view, list(rule.choose(view).values()))


AREA = ("???????", "??fff??", "?.....?", "?#.R..?", "?.....?", "??fff??", "???????")
"""Frontiers ahead and behind, an obstacle to the left, walls out of sight to the right."""


def test_the_list_goes_clockwise_from_the_left() -> None:
    view = view_of(*AREA)
    (robot,) = view.robots
    listed = clockwise(view, robot, view.frontier(robot).cells)
    assert xy(view, listed) == [(2, 5), (3, 5), (4, 5), (4, 1), (3, 1), (2, 1)]


@pytest.mark.parametrize(("heading", "goal"), [(NORTH, (4, 5)), (SOUTH, (2, 1))])
def test_the_robot_goes_along_the_list_from_its_left_up_to_a_jump(heading: int, goal: tuple[int, int]) -> None:
    assert went(Orientation(), view_of(*AREA, heading=heading)) == [goal]


def test_the_robot_goes_less_than_the_share_of_its_range_along_the_list() -> None:
    line = "f" * 21
    view = view_of("?" * 21, line, "." * 10 + "R" + "." * 10, "#" * 21, range_m=10.0)
    assert went(Orientation(), view) == [(7, 2)]  # head at x = 1: the next one is 7 away
    assert went(Orientation(share=0.3), view) == [(3, 2)]
    assert went(Orientation(share=0.0), view) == [(1, 2)]


OUT_OF_SIGHT = ("?f?????????", "#.#########", "#.........f", "#.#########", "#R#########")
NONE_IN_SIGHT = ("#####f????", "#....#####", "#.##.....f", "#R########")
CUT_OFF = ("?fff?", "##?##", "#...#", "#.R.f", "#####")


@pytest.mark.parametrize("rule", [Orientation(), WidestFrontier()])
@pytest.mark.parametrize(("rows", "goal"), [(OUT_OF_SIGHT, (1, 4)), (NONE_IN_SIGHT, (9, 1)), (CUT_OFF, (4, 1))])
def test_a_frontier_in_sight_is_chosen_and_of_those_out_of_sight_the_closest_that_can_be_reached(
    rule: Orientation | WidestFrontier, rows: tuple[str, ...], goal: tuple[int, int]
) -> None:
    assert went(rule, view_of(*rows)) == [goal]
    assert went(rule, view_of("#####", "#.R.#", "#####")) == []


def test_a_robot_on_its_way_keeps_to_it() -> None:
    view = view_of(*AREA, goal=37)
    assert Orientation().choose(view) == {}
    assert WidestFrontier().choose(view) == {}


def test_the_middle_of_the_widest_frontier_is_chosen() -> None:
    view = view_of("?????????", "#ff#fffff", "#.......#", "#...R...#", "#########")
    assert went(WidestFrontier(), view) == [(6, 3)]


@given(heading=st.integers(0, 7), seed=st.integers(0, 10_000))
def test_the_order_is_that_of_angles_from_the_left(heading: int, seed: int) -> None:
    view = view_of(*["f" * 9] * 4, "ffffRffff", *["f" * 9] * 4, heading=heading)
    (robot,) = view.robots
    cells = np.random.default_rng(seed).permutation(view.frontier(robot).cells)[:12]
    turns = []
    for x, y in xy(view, clockwise(view, robot, cells)):
        degrees = math.degrees(math.atan2(y - robot.cell.y, x - robot.cell.x))
        turns.append(round((90 + 45 * heading - degrees) % 360, 6) % 360)
    assert turns == sorted(turns)
    assert sorted(clockwise(view, robot, cells)) == sorted(cells)


@pytest.mark.parametrize("heading", [EAST, NORTH, WEST, SOUTH])
def test_straight_left_comes_first_and_just_behind_left_last(heading: int) -> None:
    view = view_of(*["f" * 5] * 2, "ffRff", *["f" * 5] * 2, heading=heading)
    (robot,) = view.robots
    listed = xy(view, clockwise(view, robot, view.frontier(robot).cells))
    left = {EAST: (0, 1), NORTH: (-1, 0), WEST: (0, -1), SOUTH: (1, 0)}[heading]
    assert listed[0] == (2 + 2 * left[0], 2 + 2 * left[1])
    assert listed[1] == (2 + left[0], 2 + left[1])
