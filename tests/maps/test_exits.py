"""Ways out of no-go zones: short, through no other zone, and towards where the robot has to go."""

from support.missions.small_teams import drawn_grid, kinds_of

from marsupial.maps.exits import Exits
from marsupial.maps.territory import Territory
from marsupial.model import Cell, Grid, RobotReport, Zone, ZoneKind
from marsupial.model.zones import zoned

HALL = drawn_grid("#" * 17, "#...............#", "#...............#", "#" * 17)
CARRIER = kinds_of()["carrier"]


def closed(left: int, right: int) -> Zone:
    """Return a zone over the columns of a hall from `left` to `right`."""
    corners = ((float(left), 0.0), (right + 1.0, 0.0), (right + 1.0, 4.0), (float(left), 4.0))
    return Zone(kind=ZoneKind.NO_GO, polygon_m=corners)


def exits(*zones: Zone, grid: Grid = HALL) -> Exits:
    drawn = zoned(grid, {str(i): zone for i, zone in enumerate(zones)})
    return Exits(Territory(drawn, (CARRIER,)), {"c": Cell(15, 1)})


def test_a_robot_outside_has_no_way_out() -> None:
    assert exits(closed(5, 9)).way("carrier", Cell(4, 1)) is None
    assert exits().way("carrier", Cell(4, 1)) is None


def test_a_robot_leaves_to_the_larger_part() -> None:
    way = exits(closed(5, 12)).way("carrier", Cell(10, 1))
    assert way == tuple(Cell(x, 1) for x in range(10, 3, -1))


def test_a_robot_leaves_towards_its_goal_and_home() -> None:
    leaving = exits(closed(5, 12))
    assert leaving.way("carrier", Cell(6, 1), Cell(14, 2)) == tuple(Cell(x, 1) for x in range(6, 14))
    there = RobotReport(name="c", type="carrier", cell=Cell(10, 1), carrier=None, free_at_ms=500)
    outside = leaving.outside(there)
    assert (outside.cell, outside.free_at_ms, outside.heading) == (Cell(13, 1), 3500, 0)


def test_a_robot_passes_through_no_other_zone() -> None:
    leaving = exits(closed(5, 9), closed(10, 11))
    assert leaving.way("carrier", Cell(9, 1), Cell(14, 1)) == tuple(Cell(x, 1) for x in range(9, 3, -1))
    assert exits(closed(1, 9), closed(10, 11)).way("carrier", Cell(9, 1)) is None


def test_a_robot_with_no_known_ground_outside_stays() -> None:
    assert exits(closed(0, 16)).way("carrier", Cell(9, 1)) is None
    there = RobotReport(name="c", type="carrier", cell=Cell(9, 1), carrier=None, free_at_ms=0)
    assert exits(closed(0, 16)).outside(there) == there


def test_ground_that_becomes_known_in_a_zone_opens_a_way() -> None:
    grid = drawn_grid("#" * 9, "#...?...#", "#" * 9)
    cells = grid.cells.copy()
    leaving = exits(closed(1, 5), grid=Grid(cells=cells, resolution_m=1.0))
    assert leaving.way("carrier", Cell(2, 1)) is None
    cells[1, 4] = 1
    assert leaving.way("carrier", Cell(2, 1)) == tuple(Cell(x, 1) for x in range(2, 7))
