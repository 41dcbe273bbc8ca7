import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from marsupial.maps.targets import Frontier
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, Cell, Grid, RobotType, Role
from marsupial.papers.mei2006.rules import Orientation, WidestFrontier, clockwise
from marsupial.paths.fields import PathSearch
from marsupial.strategies.frontier.view import Explorer, FrontierView

CODES = {"#": OBSTACLE, ".": FLOOR, "f": FLOOR, "R": FLOOR, "?": UNKNOWN}
NORTH, EAST, SOUTH, WEST = 2, 0, 6, 4


def view_of(*lines: str, heading: int | None = NORTH, range_m: float = 10.0, goal: int | None = None) -> FrontierView:
    """Return the moment of a drawing, whose last line is row 0: `R` is the robot, `f` are the frontier cells."""
    rows = list(reversed(lines))
    grid = Grid(cells=np.array([[CODES[char] for char in row] for row in rows], dtype=np.uint8), resolution_m=1.0)
    cells = np.flatnonzero(np.array([[char == "f" for char in row] for row in rows]))
    (place,) = [Cell(x, y) for y, row in enumerate(rows) for x, char in enumerate(row) if char == "R"]
    kind = RobotType(
        name="robot",
        role=Role.CARRIER,
        speed_mps=1.0,
        sensor_range_m=range_m,
        radius_m=0.0,
        terrains=frozenset({FLOOR}),
    )
    standable = grid.cells == FLOOR
    search = PathSearch(standable)

    def lengths(robot: Explorer, wanted: np.ndarray) -> np.ndarray:
        return search.costs(robot.cell, [Cell(int(i) % grid.width, int(i) // grid.width) for i in wanted])

    return FrontierView(
        grid=grid,
        robots=(Explorer(name="r", kind=kind, cell=place, heading=heading, goal=goal),),
        frontiers={"robot": Frontier(cells=cells, viewpoints=cells)},
        standable={"robot": standable},
        lengths=lengths,
        rng=np.random.default_rng(0),
    )


def xy(view: FrontierView, cells: Sequence[int] | np.ndarray) -> list[tuple[int, int]]:
    return [tuple(view.cell(int(cell))) for cell in cells]


AREA = (
    "???????",
    "??fff??",
    "?.....?",
    "?#.R..?",
    "?.....?",
    "??fff??",
    "???????",
)
"""Frontiers ahead and behind, an obstacle to the left, walls out of sight to the right."""


def test_the_list_goes_clockwise_from_the_left() -> None:
    view = view_of(*AREA)
    (robot,) = view.robots
    listed = clockwise(view, robot, view.frontier(robot).cells)
    assert xy(view, listed) == [(2, 5), (3, 5), (4, 5), (4, 1), (3, 1), (2, 1)]


def test_the_robot_goes_along_the_list_up_to_a_jump() -> None:
    view = view_of(*AREA)
    assert xy(view, list(Orientation().choose(view).values())) == [(4, 5)]


def test_facing_the_other_way_the_list_begins_on_the_other_side() -> None:
    view = view_of(*AREA, heading=SOUTH)
    assert xy(view, list(Orientation().choose(view).values())) == [(2, 1)]


def test_the_robot_goes_less_than_the_share_of_its_range_along_the_list() -> None:
    line = "f" * 21
    view = view_of("?" * 21, line, "." * 10 + "R" + "." * 10, "#" * 21, range_m=10.0)
    assert xy(view, list(Orientation().choose(view).values())) == [(7, 2)]  # head at x = 1: the next one is 7 away
    assert xy(view, list(Orientation(share=0.3).choose(view).values())) == [(3, 2)]
    assert xy(view, list(Orientation(share=0.0).choose(view).values())) == [(1, 2)]


def test_a_frontier_out_of_sight_or_range_is_no_choice_while_there_is_another() -> None:
    lines = (
        "?f?????????",
        "#.#########",
        "#.........f",
        "#.#########",
        "#R#########",
    )
    for rule in (Orientation(), WidestFrontier()):
        view = view_of(*lines)
        assert xy(view, list(rule.choose(view).values())) == [(1, 4)]


def test_where_none_is_in_sight_the_closest_is_chosen() -> None:
    lines = (
        "#####f????",
        "#....#####",
        "#.##.....f",
        "#R########",
    )
    for rule in (Orientation(), WidestFrontier()):
        view = view_of(*lines)
        assert xy(view, list(rule.choose(view).values())) == [(9, 1)]
        assert list(rule.choose(view_of("#####", "#.R.#", "#####")).values()) == []


def test_frontier_cells_that_can_not_be_reached_are_no_choice() -> None:
    lines = (
        "?fff?",
        "##?##",
        "#...#",
        "#.R.f",
        "#####",
    )
    for rule in (Orientation(), WidestFrontier()):
        view = view_of(*lines)
        assert xy(view, list(rule.choose(view).values())) == [(4, 1)]


def test_a_robot_on_its_way_keeps_to_it() -> None:
    view = view_of(*AREA, goal=37)
    assert Orientation().choose(view) == {}
    assert WidestFrontier().choose(view) == {}


def test_the_middle_of_the_widest_frontier_is_chosen() -> None:
    view = view_of(
        "?????????",
        "#ff#fffff",
        "#.......#",
        "#...R...#",
        "#########",
    )
    assert xy(view, list(WidestFrontier().choose(view).values())) == [(6, 3)]


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
