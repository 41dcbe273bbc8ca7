from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import aboard, carrier, draw, picture, random_cells, rover, standing
from support.maps.from_scratch import reach_from_scratch

from marsupial.maps.growth import GrowingReach
from marsupial.maps.targets import TargetFinder
from marsupial.maps.territory import Reach, Territory
from marsupial.model import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Mask, PlacedRobot

CARRIER, ROVER = carrier(), rover()


def assert_same(mine: Reach, theirs: Reach) -> None:
    for name, mask in theirs.by_type.items():
        assert np.array_equal(mine.by_type[name], mask), name
    assert mine.docking.keys() == theirs.docking.keys()
    for pair, docking in theirs.docking.items():
        assert np.array_equal(mine.docking[pair].cells, docking.cells)
        cells = np.flatnonzero(docking.cells)
        assert np.array_equal(mine.docking[pair].carrier_at(cells), docking.carrier_at(cells))


def test_ground_that_only_a_lost_robot_reached_is_out_of_reach_again() -> None:
    growing = GrowingReach(Territory(draw("..#.."), (ROVER,)))
    r, s = standing("r", Cell(0, 0), "rover"), standing("s", Cell(4, 0), "rover")
    assert picture(growing.reach([r, s]).by_type["rover"]) == ["xx.xx"]
    assert picture(growing.reach([s]).by_type["rover"]) == ["...xx"]


def test_a_rover_picked_up_reaches_what_its_carrier_can_set_it_down_at() -> None:
    rows = ("......##", "......##", "......#.")
    growing = GrowingReach(Territory(draw(*rows), (CARRIER, ROVER)))
    c = standing("c", Cell(1, 1))
    assert picture(growing.reach([c, standing("r", Cell(7, 0), "rover")]).by_type["rover"])[2] == "xxxxxx.x"
    assert picture(growing.reach([c, aboard("r", "c")]).by_type["rover"])[2] == "xxxxxx.."


def test_a_part_as_large_as_the_map_is_given_up() -> None:
    growing = GrowingReach(Territory(draw("......", "......"), (replace(CARRIER, capacity=0), ROVER)))
    c = standing("c", Cell(5, 1))
    assert picture(growing.reach([c, standing("r", Cell(0, 0), "rover")]).by_type["rover"]) == ["xxxxxx"] * 2
    assert picture(growing.reach([c, aboard("r", "c")]).by_type["rover"]) == ["......"] * 2


def cell_in(mask: Mask, data: st.DataObject) -> Cell | None:
    inside = np.flatnonzero(mask)
    if not len(inside):
        return None
    index = int(data.draw(st.sampled_from(inside.tolist())))
    return Cell(index % mask.shape[1], index // mask.shape[1])


def moved(robot: PlacedRobot, reach: Reach, data: st.DataObject) -> PlacedRobot:
    """Return a next position: the same, aboard (even if that is unreachable), or set down."""
    docking = reach.docking["carrier", "rover"].cells
    if robot.cell is None:
        cell = cell_in(docking, data) if data.draw(st.booleans()) else None
        return robot if cell is None else standing(robot.name, cell, robot.type)
    if robot.type == "rover" and data.draw(st.booleans()):
        return aboard(robot.name, "c")
    return robot


@given(truth=random_cells(codes=(OBSTACLE, FLOOR, FLOOR, FLOOR, ROUGH)), seed=st.integers(0, 2**32 - 1), data=st.data())
def test_incremental_reach_and_frontiers_equal_those_from_scratch(
    truth: CellArray, seed: int, data: st.DataObject
) -> None:
    rng = np.random.default_rng(seed)
    known = np.full_like(truth, UNKNOWN)
    territory = Territory(Grid(cells=known, resolution_m=1.0), (CARRIER, ROVER))
    growing, finder = GrowingReach(territory), TargetFinder(territory)
    free = np.flatnonzero(truth == FLOOR)
    if not len(free):
        return
    c, r, s = (Cell(int(i) % truth.shape[1], int(i) // truth.shape[1]) for i in rng.choice(free, 3))
    robots = [standing("c", c), standing("r", r, "rover"), aboard("s", "c"), standing("t", s, "rover")]
    order = rng.permutation(truth.size)
    for new in np.array_split(order, data.draw(st.integers(1, 5))):
        known.ravel()[new] = truth.ravel()[new]
        territory.reveal(new)
        reach = reach_from_scratch(territory, robots)
        grown = growing.reach(robots)
        assert_same(grown, reach)
        anew = TargetFinder(territory).frontiers(reach)
        for name, frontier in finder.frontiers(grown).items():
            assert frontier.cells.tolist() == anew[name].cells.tolist()
            assert frontier.viewpoints.tolist() == anew[name].viewpoints.tolist()
        robots = [moved(robot, reach, data) for robot in robots]
        if len(robots) > 2 and data.draw(st.integers(0, 4)) == 0:
            robots = robots[:-1]
