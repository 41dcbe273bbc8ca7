import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import aboard, carrier, draw, mask_of, picture, random_cells, rover, standing, where
from support.maps.from_scratch import nearest_sources

from marsupial.maps.growth import reach_of
from marsupial.maps.territory import Territory, dock_range_cells, within_range
from marsupial.maps.window import Window
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, Terrain

CARRIER, ROVER = carrier(), rover()

ROOM = ("#########", "#.......#", "#.......#", "####.####", "#.......#", "#...c...#", "#.......#", "#########")


def test_bodies_touch_when_docking_give_or_take_a_cell() -> None:
    assert dock_range_cells(CARRIER, ROVER, 1.0) == pytest.approx(1.2 + 0.2 + 2**0.5)
    assert dock_range_cells(CARRIER, ROVER, 0.1) == pytest.approx(14 + 2**0.5)


def test_a_carrier_reaches_what_is_connected_to_it() -> None:
    reach = reach_of(Territory(draw(*ROOM), (CARRIER, ROVER)), [standing("c", *where("c", *ROOM))])
    assert picture(reach.by_type["carrier"]) == [*["........."] * 4, "....x....", "..xxxxx..", ".........", "........."]


def test_a_rover_aboard_reaches_what_is_connected_to_where_it_can_be_set_down() -> None:
    reach = reach_of(Territory(draw(*ROOM), (CARRIER, ROVER)), [standing("c", *where("c", *ROOM)), aboard("r", "c")])
    assert picture(reach.by_type["rover"]) == [
        row.replace(".", "x").replace("c", "x").replace("#", ".") for row in ROOM
    ]


def test_a_rover_docks_no_farther_than_bodies_reach() -> None:
    reach = reach_of(Territory(draw(*ROOM), (CARRIER, ROVER)), [standing("c", *where("c", *ROOM)), aboard("r", "c")])
    docking = reach.docking["carrier", "rover"]
    assert picture(docking.cells) == [
        ".........",
        ".........",
        "....x....",
        "....x....",
        ".xxxxxxx.",
        ".xxxxxxx.",
        ".xxxxxxx.",
        ".........",
    ]
    assert docking.carrier_at(np.array([5 * 9 + 4, 3 * 9 + 1])).tolist() == [3 * 9 + 4, 2 * 9 + 2]


def test_no_robot_docks_through_a_wall() -> None:
    rows = ("....", "####", "....", ".c..", "....")
    reach = reach_of(Territory(draw(*rows), (CARRIER, ROVER)), [standing("c", *where("c", *rows)), aboard("r", "c")])
    assert picture(reach.docking["carrier", "rover"].cells) == ["....", "....", "xxxx", "xxxx", "xxxx"]


def test_a_rover_may_be_set_down_on_ground_that_the_carrier_cannot_drive_on() -> None:
    rows = ("...,,,", ".c.,,,", "...,,,")
    reach = reach_of(Territory(draw(*rows), (CARRIER, ROVER)), [standing("c", *where("c", *rows)), aboard("r", "c")])
    assert picture(reach.docking["carrier", "rover"].cells) == ["xxxx.."] * 3
    assert reach.by_type["rover"].all()


def test_a_carrier_with_no_places_docks_with_nobody() -> None:
    reach = reach_of(
        Territory(draw(*ROOM), (carrier(capacity=0), ROVER)),
        [standing("c", *where("c", *ROOM)), standing("r", Cell(1, 6), "rover")],
    )
    assert reach.docking == {}
    assert reach.by_type["rover"].sum() == 36


def test_opaque_cells_block_sight() -> None:
    hedge = Terrain(code=ROUGH, name="hedge", blocks_sight=True)
    grid = Grid(cells=draw("#.,?").cells, resolution_m=1.0, terrains=(Terrain(code=FLOOR, name="floor"), hedge))
    assert picture(Territory(grid, (CARRIER,)).see_through) == [".x.."]
    assert picture(Territory(draw("#.,?"), (CARRIER,)).see_through) == [".xx."]


def test_the_known_window_holds_the_known_cells_and_their_neighbours() -> None:
    grid = draw("??????", "??.???", "???#??", "??????", "??????")
    assert Territory(grid, (ROVER,)).known == Window(1, 5, 1, 5)
    assert Territory(draw("..", "??"), (ROVER,)).known == Window(0, 2, 0, 2)


def test_where_nothing_is_known_the_window_and_every_reach_are_empty() -> None:
    territory = Territory(draw("???", "???"), (CARRIER, ROVER))
    assert territory.known == Window(0, 0, 0, 0)
    reach = reach_of(territory, [standing("c", Cell(1, 1)), aboard("r", "c")])
    assert not any(mask.any() for mask in reach.by_type.values())


def test_cells_of_a_window_are_found_again_on_the_map() -> None:
    window = Window.around(Cell(2, 1), Cell(3, 2), 1, (4, 9))
    assert window == Window(0, 4, 1, 5)
    everywhere = np.arange(36).reshape(4, 9)
    cut = everywhere[window.cut]
    assert np.array_equal(window.on_map(np.arange(16), 9), cut.ravel())
    assert np.array_equal(window.inside(cut.ravel(), 9), np.arange(16))
    assert mask_of("x.")[Window(0, 1, 0, 1).cut].all()


@given(truth=random_cells(codes=(OBSTACLE, FLOOR, FLOOR, FLOOR, ROUGH)), data=st.data())
def test_a_territory_that_grew_equals_one_made_at_once(truth: CellArray, data: st.DataObject) -> None:
    height, width = truth.shape
    order = np.array(data.draw(st.permutations(range(truth.size))), dtype=np.int64)
    shown = np.split(order, sorted(data.draw(st.lists(st.integers(0, truth.size), min_size=1, max_size=3))))[:-1]
    known = np.full_like(truth, UNKNOWN)
    grid = Grid(cells=known, resolution_m=1.0)
    grown = Territory(grid, (CARRIER, ROVER))
    for new in shown:
        known.ravel()[new] = truth.ravel()[new]
        grown.reveal(new)
    cells = st.builds(Cell, st.integers(0, width - 1), st.integers(0, height - 1))
    robots = [standing("c", data.draw(cells)), aboard("r", "c"), standing("s", data.draw(cells), "rover")]
    reach, again = reach_of(grown, robots), Territory(Grid(cells=known.copy(), resolution_m=1.0), (CARRIER, ROVER))
    assert np.array_equal(grown.see_through, again.see_through)
    for name in ("carrier", "rover"):
        assert np.array_equal(reach.by_type[name], reach_of(again, robots).by_type[name])
        assert not (reach.by_type[name] & ~grown.footprints[name].standable).any()
    docking = reach.docking["carrier", "rover"]
    nearest = nearest_sources(grown.see_through, reach.by_type["carrier"], dock_range_cells(CARRIER, ROVER, 1.0))
    cells = (nearest >= 0) & grown.footprints["rover"].standable
    assert np.array_equal(docking.cells, cells)
    assert np.array_equal(docking.carrier_at(np.flatnonzero(cells)), nearest[cells])


@pytest.mark.parametrize(("limit", "joined"), [(1.9, False), (2.0, False), (6.0, True)])
def test_two_robots_behind_a_wall_are_as_far_apart_as_the_way_around_it(limit: float, joined: bool) -> None:
    room = draw("...", "##.", "...")
    see_through = room.cells == FLOOR
    assert within_range(Cell(0, 0), Cell(0, 2), limit, see_through) is joined
    assert within_range(Cell(0, 0), Cell(2, 0), limit, see_through) is (limit >= 2)
