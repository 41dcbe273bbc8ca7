from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.maps import drawn_maps

from marsupial.formats.mapfiles.read import read_map
from marsupial.maps.describe import TerrainShare, describe
from marsupial.model import FLOOR, OBSTACLE, ROUGH, UNKNOWN, Grid, LegendEntry, MapReading
from marsupial.model.robots import RobotType, default_types

CARRIER, ROVER = default_types(2)

draw = partial(drawn_maps.draw, resolution_m=0.5)


def reading_of(grid: Grid, *, walled: bool = False, warnings: tuple[str, ...] = ()) -> MapReading:
    return MapReading(grid=grid, format="drawing", walled=walled, warnings=warnings)


ROOM = draw("?????", "?###?", "?#.#?", "?#,#?", "?###?")


def test_shares_and_sizes_are_those_of_the_drawing() -> None:
    found = describe(ROOM, ())
    assert (found.width, found.height, found.width_m, found.height_m, found.resolution_m) == (5, 5, 2.5, 2.5, 0.5)
    assert found.free == (
        TerrainShare(name="floor", code=FLOOR, cells=1, area_m2=0.25, share=0.04),
        TerrainShare(name="rough", code=ROUGH, cells=1, area_m2=0.25, share=0.04),
    )
    assert (found.occupied.cells, found.unknown.cells) == (10, 13)
    assert (sum(c.area_m2 for c in found.free), sum(c.share for c in found.free)) == (0.5, 0.08)
    assert found.occupied.share + found.unknown.share + sum(c.share for c in found.free) == pytest.approx(1)
    assert found.warnings == ()


def test_free_space_that_leaks_to_the_border_is_named_with_its_area() -> None:
    found = describe(draw("#####", "#..#.", "#..#.", "#####", "#....", "#####"), ())
    assert found.border_cells == 3
    assert found.border_area_m2 == 6 * 0.25
    assert found.warnings == (
        "free space leaks to the border: 3 of the cells on it are free, and 1.5 m2 of free space (60.0%) are "
        "connected to them; robots may explore outside the walls, and the edge counts as the end of the world: leave a "
        "row of unknown cells where it goes on, or close the map (`marsupial map FILE --boundary OUT`)",
    )


def test_a_diagonal_gap_is_no_connection() -> None:
    found = describe(draw("####", "#.##", "##.#", "##.#"), ())
    assert found.border_area_m2 == 2 * 0.25


def test_a_stray_free_pixel_at_the_border_is_no_leak() -> None:
    cells = np.full((100, 100), FLOOR, dtype=np.uint8)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = cells[:, 1] = OBSTACLE
    cells[50, 0] = FLOOR
    found = describe(Grid(cells=cells, resolution_m=0.05), ())
    assert found.border_cells == 1
    assert found.warnings == ()


def with_hole(wide: int) -> Grid:
    """Return a hall of 5 m by 4 m, at 5 cm a cell, with a hole in its wall and 1 m of open ground outside."""
    cells = np.full((82, 122), FLOOR, dtype=np.uint8)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, 100] = OBSTACLE
    cells[40 : 40 + wide, 100] = FLOOR
    return Grid(cells=cells, resolution_m=0.05)


@pytest.mark.parametrize("kinds", [(), (CARRIER, ROVER)])
def test_a_hole_that_no_robot_gets_through_is_no_leak(kinds: tuple[RobotType, ...]) -> None:
    for wide in (1, 4):
        found = describe(with_hole(wide), kinds)
        assert (found.border_cells, found.warnings) == (80, ())
        assert found.border_area_m2 > 20
        assert [entry.at_border for entry in found.reach] == [False] * len(kinds)


@pytest.mark.parametrize("kinds", [(), (CARRIER, ROVER)])
def test_a_hole_that_some_robot_gets_through_is_a_leak(kinds: tuple[RobotType, ...]) -> None:
    found = describe(with_hole(8), kinds)
    (warning,) = found.warnings
    assert warning.startswith("free space leaks to the border: 80 of the cells on it are free, and 24")
    assert [entry.at_border for entry in found.reach] == [False, True][: len(kinds)]


def test_a_single_free_cell_at_the_border_leads_nowhere() -> None:
    grid = draw("#####", "#...#", "#....", "#...#", "#####")
    assert describe(grid, (ROVER,)).reach[0].at_border
    assert describe(grid, (ROVER,)).warnings == describe(grid, ()).warnings == ()


def test_a_format_that_closes_the_map_does_not_leak() -> None:
    grid = draw("..", ".#")
    assert describe(grid, (), reading=reading_of(grid, walled=True)).warnings == ()


def test_a_scanned_map_without_unknown_is_named() -> None:
    grid = draw("###", "#.#", "###")
    assert describe(grid, ()).warnings == ()
    (warning,) = describe(grid, (), reading=reading_of(grid)).warnings
    assert warning.startswith("there is no unknown cell")


def test_maps_without_obstacles_or_without_free_cells_are_named() -> None:
    assert "there is no obstacle: no wall was recognised" in describe(draw("?.?"), ()).warnings
    assert describe(draw("?#?"), ()).warnings == ("there is no free cell: no robot can stand anywhere",)


@pytest.mark.parametrize("resolution_m", [0.001, 5.0, 50.0])
def test_a_suspicious_resolution_is_named(resolution_m: float) -> None:
    (warning,) = describe(replace(ROOM, resolution_m=resolution_m), ()).warnings
    assert warning.startswith(f"resolution {resolution_m:g} m per cell")


def test_warnings_of_the_reader_come_first() -> None:
    grid = draw("..", "?#")
    reading = replace(
        reading_of(grid, warnings=("grey 205 became free",)),
        legend=(LegendEntry(symbol="grey 205", code=FLOOR, cells=2),),
    )
    found = describe(grid, (), reading=reading)
    assert found.warnings[0] == "grey 205 became free"
    assert len(found.warnings) == 2
    assert (found.format, found.legend) == ("drawing", reading.legend)


def test_reach_is_the_largest_part_each_type_can_stand_in() -> None:
    grid = draw("########", "#...#..#", "#...#..#", "#...#..#", "########")
    carrier, rover = describe(grid, (replace(CARRIER, radius_m=0.6), ROVER)).reach
    assert (carrier.type, carrier.radius_m, carrier.area_m2, carrier.parts) == ("carrier", 0.6, 0.25, 1)
    assert (rover.type, rover.radius_m, rover.area_m2, rover.parts) == ("rover", 0.15, 9 * 0.25, 2)


def test_terrain_a_type_can_not_drive_on_is_not_in_its_reach() -> None:
    carrier, rover = describe(draw("#####", "#.,.#", "#####"), (replace(CARRIER, radius_m=0.1), ROVER)).reach
    assert (carrier.area_m2, carrier.parts) == (0.25, 2)
    assert (rover.area_m2, rover.parts) == (0.75, 1)


def specked(specks: int, rooms: int = 1, size: int = 1) -> Grid:
    """Return halls of 4 m by 4 m, at 5 cm a cell, with a door between each two and specks in a row across the first."""
    cells = np.full((84, 82 * rooms + 2), OBSTACLE, dtype=np.uint8)
    for room in range(rooms):
        cells[2:82, 2 + 82 * room : 82 + 82 * room] = FLOOR
        cells[31:53, 82 * room : 82 * room + 2] = FLOOR if room else OBSTACLE
    for k in range(specks):
        cells[12 * k + 6 : 12 * k + 6 + size, 40 : 40 + size] = UNKNOWN
    return Grid(cells=cells, resolution_m=0.05)


def test_specks_that_keep_carriers_out_are_named_with_the_area() -> None:
    free = replace(specked(6, 2), cells=np.where(specked(6, 2).cells == UNKNOWN, FLOOR, specked(6, 2).cells))
    gain_m2 = describe(free, (CARRIER,)).reach[0].area_m2 - describe(specked(6, 2), (CARRIER,)).reach[0].area_m2
    assert gain_m2 > 5
    assert describe(specked(6, 2), (CARRIER, ROVER)).warnings == (
        f"6 specks of unknown inside free space keep carrier (radius 0.5 m) out of {gain_m2:.4g} m2: paint them free, "
        "unless something stands there",
    )


def test_specks_that_keep_no_carrier_out_of_much_are_not_named() -> None:
    assert describe(specked(1, 6), (CARRIER, ROVER)).warnings == ()
    assert describe(specked(6, 2), (ROVER,)).warnings == ()


def test_unknown_as_large_as_a_carrier_is_no_speck() -> None:
    (warning,) = describe(specked(1, 1, size=17), (CARRIER,)).warnings
    assert warning.startswith("1 speck of unknown inside free space keeps carrier")
    assert describe(specked(1, 1, size=18), (CARRIER,)).warnings == ()


def test_noise_that_keeps_a_type_out_of_nearly_all_is_named_with_what_to_do() -> None:
    free = specked(0)
    cells = free.cells.copy()
    cells[6:82:8, 6:82:8] = OBSTACLE
    nowhere, carriers = describe(replace(free, cells=cells), (CARRIER, ROVER)).warnings
    assert nowhere == "carrier (radius 0.5 m) can stand nowhere on this map"
    assert carriers.startswith("100 specks of obstacle, each smaller than rover, keep carrier (radius 0.5 m) out of ")
    assert carriers.endswith("`marsupial map FILE --clean OUT` writes the map without them")


def test_a_type_that_fits_nowhere_is_named() -> None:
    found = describe(draw("###", "#.#", "###"), (replace(CARRIER, radius_m=0.6), ROVER))
    assert found.reach[0].area_m2 == 0
    assert found.warnings == ("carrier (radius 0.6 m) can stand nowhere on this map",)


def test_a_map_on_which_rovers_go_nowhere_else_is_named() -> None:
    found = describe(draw("###", "#.#", "###", resolution_m=1.0), (CARRIER, ROVER))
    assert found.warnings == ("rovers can stand nowhere that carriers can't (a cell is 1 m): nothing needs a rover",)


# Real maps


def test_the_real_depot_warns_of_its_threshold_and_its_missing_unknown_but_not_of_holes_of_a_pixel(
    shared_maps: Path,
) -> None:
    reading = read_map(shared_maps / "depot_nav2.yaml")
    found = describe(reading.grid, (), reading=reading)
    assert found.border_area_m2 == pytest.approx(438.5, abs=0.05)
    assert [warning[:24] for warning in found.warnings] == ["grey 205 became free in ", "there is no unknown cell"]
    repaired = read_map(shared_maps / "depot_nav2_fixed.yaml")
    assert describe(repaired.grid, (), reading=repaired).warnings == ()


@pytest.mark.parametrize(("name", "area_m2"), [("fr079", 246), ("fr101", 124), ("warehouse_aws", 208)])
def test_the_rovers_reach_on_real_maps_is_the_known_one(shared_maps: Path, name: str, area_m2: float) -> None:
    reading = read_map(shared_maps / f"{name}.yaml")
    found = describe(reading.grid, (CARRIER, ROVER), reading=reading)
    assert found.reach[1].area_m2 == pytest.approx(area_m2, abs=1)
    assert 0 < found.reach[0].area_m2 < found.reach[1].area_m2
    assert not found.warnings
