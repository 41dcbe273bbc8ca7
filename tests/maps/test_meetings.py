import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.maps.drawn_maps import ONE_DOOR, aboard, carrier, draw, random_cells, rover, standing, where

from marsupial.maps.growth import reach_of
from marsupial.maps.meetings import STRETCH_M, Meetings, find_meetings
from marsupial.maps.targets import Target, TargetFinder
from marsupial.maps.territory import Reach, Territory, dock_range_cells
from marsupial.model import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Cell, CellArray, Grid, MapMeeting, PlacedRobot, RobotType

CARRIER, ROVER = carrier(), rover()
KINDS = (CARRIER, ROVER)

CLOSED = tuple(row.replace("?", "#") for row in ONE_DOOR)
CLOSE_DOORS = (
    "######?######",
    "#...........#",
    "#...........#",
    "#...........#",
    "###.####.####",
    "#...........#",
    "#.c.........#",
    "#...........#",
    "#############",
)


def analysed(
    grid: Grid, *robots: PlacedRobot, kinds: tuple[RobotType, ...] = KINDS, keep: Iterable[MapMeeting] = ()
) -> tuple[Meetings, tuple[Target, ...], Reach]:
    territory = Territory(grid, kinds)
    reach = reach_of(territory, robots)
    finder = TargetFinder(territory)
    targets = finder.find(finder.frontiers(reach))
    return find_meetings(territory, reach, targets, robots, keep), targets, reach


def at_borders(rows: tuple[str, ...], resolution_m: float = 1.0) -> tuple[list[Cell], Meetings, tuple[Target, ...]]:
    """Return the rover cells of the meeting points where no carrier is, for a carrier with a rover at ``c``."""
    (cell,) = where("c", *rows)
    kinds = tuple(replace(kind, radius_m=kind.radius_m * resolution_m) for kind in KINDS)
    found, targets, _ = analysed(
        draw(*rows, resolution_m=resolution_m), standing("c", cell), aboard("r", "c"), kinds=kinds
    )
    return sorted(p.rover_cell for p in found.points if p.carrier_cell != cell), found, targets


def test_a_room_with_one_door_has_one_point_at_it() -> None:
    cells, found, targets = at_borders(ONE_DOOR)
    assert cells == [Cell(4, 5)]
    (target,) = targets
    assert set(target.viewpoints) == {"rover"}
    (name,) = (p.name for p in found.points if p.rover_cell == Cell(4, 5))
    assert found.connects[name] == {target.name}


def test_two_doors_close_together_have_a_point_each() -> None:
    cells, _, _ = at_borders(CLOSE_DOORS, resolution_m=0.5)
    assert cells == [Cell(3, 5), Cell(8, 5)]


def test_a_target_at_the_door_itself_is_served_by_that_door_alone() -> None:
    _, found, (target,) = at_borders(("?.,..", ",..c.", ",,?.."))
    assert target.viewpoints == {"rover": Cell(2, 1)}
    assert found.connects == {"m_1_1_3_1": {target.name}, "m_3_1_3_1": set()}


def test_a_long_border_has_several_points_apart_from_each_other() -> None:
    rows = ("?" * 41, *["," * 41] * 4, *["." * 41] * 2, "..c" + "." * 38, "." * 41)
    cells, _, _ = at_borders(rows)
    assert len(cells) >= 41 / STRETCH_M
    assert all(any(abs(cell.x - x) <= STRETCH_M / 2 for cell in cells) for x in range(41))
    assert {cell.y for cell in cells} == {cells[0].y}
    assert all(abs(a.x - b.x) > STRETCH_M / 2 for a, b in combinations(cells, 2))


@pytest.mark.parametrize(("rows", "explored"), [(CLOSED, True), (("??????", "......", ".c....", "......"), False)])
def test_an_area_that_needs_no_rover_has_no_point(rows: tuple[str, ...], explored: bool) -> None:
    cells, _, targets = at_borders(rows)
    assert (cells, targets == ()) == ([], explored)


def test_an_area_with_a_rover_in_it_has_a_point_at_its_door() -> None:
    robots = (standing("c", *where("c", *CLOSED)), standing("r", Cell(8, 7), "rover"))
    found, targets, _ = analysed(draw(*CLOSED), *robots)
    assert targets == ()
    assert [point.rover_cell for point in found.points] == [Cell(4, 5)]
    assert found.connects[found.points[0].name] == frozenset()


def test_a_rover_that_a_carrier_can_come_to_is_met_where_it_stands() -> None:
    robots = (standing("c", *where("c", *CLOSED)), standing("r", Cell(8, 3), "rover"))
    (point,) = analysed(draw(*CLOSED), *robots)[0].points
    assert (point.rover_cell, point.carrier_cell) == (Cell(8, 3), Cell(8, 2))


def test_a_loaded_carrier_can_set_a_rover_down_where_it_stands() -> None:
    cell = where("c", *ONE_DOOR)[0]
    found, _, _ = analysed(draw(*ONE_DOOR), standing("c", cell), aboard("r", "c"))
    assert [p.carrier_cell for p in found.points if p.carrier_cell == cell] == [cell]
    found, _, _ = analysed(draw(*ONE_DOOR), standing("c", cell), standing("r", Cell(8, 7), "rover"))
    assert [p.carrier_cell for p in found.points if p.carrier_cell == cell] == []


def test_a_target_at_the_very_border_has_a_point_that_connects_to_it() -> None:
    rows = ("####?####", "####.####", "#.......#", "#.c.....#", "#.......#", "#########")
    _, found, (target,) = at_borders(rows)
    assert any(target.name in served for served in found.connects.values())


def test_points_in_use_are_kept_and_serve_their_stretch() -> None:
    robots = (standing("c", *where("c", *ONE_DOOR)), aboard("r", "c"))
    first, _, _ = analysed(draw(*ONE_DOOR), *robots)
    again, _, _ = analysed(draw(*ONE_DOOR), *robots, keep=first.points)
    assert again.points == first.points
    assert again.connects == first.connects
    beside = MapMeeting(
        name="kept", carrier_cell=Cell(4, 3), rover_cell=Cell(4, 5), carrier_type="carrier", rover_type="rover"
    )
    found, _, _ = analysed(draw(*ONE_DOOR), *robots, keep=[beside])
    assert [p.name for p in found.points if p.rover_cell == Cell(4, 5)] == ["kept"]


def test_points_that_are_good_no_more_are_dropped() -> None:
    robots = (standing("c", *where("c", *ONE_DOOR)), aboard("r", "c"))
    walled = MapMeeting(
        name="walled", carrier_cell=Cell(4, 4), rover_cell=Cell(3, 4), carrier_type="carrier", rover_type="rover"
    )
    strange = replace(walled, name="strange", carrier_cell=Cell(4, 2), rover_cell=Cell(4, 3), rover_type="unheard of")
    found, _, _ = analysed(draw(*ONE_DOOR), *robots, keep=[walled, strange])
    assert not {"walled", "strange"} & {point.name for point in found.points}


def test_without_rovers_there_are_no_meeting_points() -> None:
    found, _, _ = analysed(draw(*ONE_DOOR), standing("c", *where("c", *ONE_DOOR)))
    assert found == Meetings(points=(), connects={})


def test_each_kind_of_rover_gets_to_the_areas_that_only_it_can_explore() -> None:
    rows = (
        "##########?##",
        "#,,,,,#.....#",
        "#,,,,,#.....#",
        "##?,###.....#",
        "####,###.####",
        "#...........#",
        "#.c.........#",
        "#...........#",
        "#############",
    )
    smooth = replace(ROVER, name="smooth", terrains=frozenset({FLOOR}))
    robots = (standing("c", *where("c", *rows)), aboard("r", "c"), aboard("t", "c", "smooth"))
    found, targets, _ = analysed(draw(*rows), *robots, kinds=(CARRIER, ROVER, smooth))
    for target in targets:
        assert any(target.name in served for served in found.connects.values()), target.name


MIXED = random_cells(codes=(OBSTACLE, FLOOR, FLOOR, FLOOR, FLOOR, ROUGH, UNKNOWN), smallest=3, largest=16)


@given(cells=MIXED, radius=st.sampled_from([0.5, 1.2, 1.5]), data=st.data())
def test_both_can_stand_and_dock_at_every_point(cells: CellArray, radius: float, data: st.DataObject) -> None:
    kinds = (
        carrier(radius_m=radius),
        ROVER,
        replace(carrier(radius_m=0.5), name="small"),
        rover("large", radius_m=1.2),
    )
    grid = Grid(cells=cells, resolution_m=1.0)
    robots = _team(grid, data)
    found, targets, reach = analysed(grid, *robots, kinds=kinds)
    assert len({point.name for point in found.points}) == len(found.points)
    assert set(found.connects) <= {point.name for point in found.points}
    by_name = {kind.name: kind for kind in kinds}
    for point in found.points:
        limit = dock_range_cells(by_name[point.carrier_type], by_name[point.rover_type], 1.0)
        assert math.dist(point.carrier_cell, point.rover_cell) <= limit
        assert reach.by_type[point.carrier_type][point.carrier_cell.y, point.carrier_cell.x]
        assert reach.by_type[point.rover_type][point.rover_cell.y, point.rover_cell.x]
    again = find_meetings(Territory(grid, kinds), reach, targets, robots, found.points)
    assert again.points == found.points


@given(cells=MIXED, data=st.data())
def test_points_kept_while_the_map_grows_are_not_found_again(cells: CellArray, data: st.DataObject) -> None:
    grid = Grid(cells=cells, resolution_m=1.0)
    robots = _team(grid, data)
    kinds = (*KINDS, carrier("small", radius_m=0.5), rover("large", radius_m=1.2))
    hidden = data.draw(st.lists(st.integers(0, cells.size - 1), max_size=cells.size // 2))
    before = cells.copy()
    before.ravel()[hidden] = UNKNOWN
    kept = analysed(Grid(cells=before, resolution_m=1.0), *robots, kinds=kinds)[0].points
    found = analysed(grid, *robots, kinds=kinds, keep=kept)[0].points
    assert set(kept) <= set(found)
    assert len({point.name for point in found}) == len(found)


@given(cells=MIXED, data=st.data())
def test_every_target_for_rovers_alone_near_a_carrier_is_connected_to_a_point(
    cells: CellArray, data: st.DataObject
) -> None:
    grid = Grid(cells=cells, resolution_m=1.0)
    cells_of = st.builds(Cell, st.integers(0, grid.width - 1), st.integers(0, grid.height - 1))
    robots = (standing("c", data.draw(cells_of)), aboard("r", "c"))
    found, targets, _ = analysed(grid, *robots)
    served = frozenset[str]().union(*found.connects.values())
    assert {target.name for target in targets if set(target.viewpoints) == {"rover"}} <= served


def _team(grid: Grid, data: st.DataObject) -> tuple[PlacedRobot, ...]:
    cells = st.builds(Cell, st.integers(0, grid.width - 1), st.integers(0, grid.height - 1))
    return (
        standing("c", data.draw(cells)),
        standing("s", data.draw(cells), "small"),
        aboard("r", "c"),
        aboard("l", "s", "large"),
        standing("g", data.draw(cells), "rover"),
    )
