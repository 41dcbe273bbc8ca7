"""What the greys of a nav2 map mean, and which maps are warned of."""

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import yaml
from nav2_files import F, O, U, grid_of, write_map
from PIL import Image

from marsupial.formats.mapfiles.images import read_grey
from marsupial.formats.mapfiles.nav2 import Mode, occupancy_table, read_header, read_nav2
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, LegendEntry


def occupancy_of(path: Path) -> npt.NDArray[np.int8]:
    """Return -1 for unknown or 0 to 100 for each cell, as `nav_msgs/OccupancyGrid` does."""
    header = read_header(path)
    image = read_grey(header.image)
    data = occupancy_table(header)[image.grey]
    if image.opaque is not None and header.mode is not Mode.RAW:
        data[~image.opaque] = -1
    return np.flipud(data)


# What greys mean


def test_saved_greys_become_free_obstacle_and_unknown(tmp_path: Path) -> None:
    grid = grid_of(write_map(tmp_path, [[254, 0, 205]]))
    assert grid.cells.tolist() == [[F, O, U]]
    assert (grid.resolution_m, grid.origin_m) == (0.5, (1.0, 2.0, 0.25))


def test_the_bottom_row_of_the_image_is_row_0(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[0, 0], [205, 254]])
    assert grid_of(path).cells.tolist() == [[U, F], [O, O]]
    assert occupancy_of(path).tolist() == [[-1, 0], [100, 100]]


@pytest.mark.parametrize(
    ("greys", "changes", "cells"),
    [
        ([255, 0, 100], {"negate": 1}, [O, F, U]),
        # p = 1 - 102/255 = 0.6 and 1 - 204/255 = 0.2
        ([102, 103, 203, 204], {"occupied_thresh": 0.6, "free_thresh": 0.2}, [O, U, U, F]),
        # 1 - 153/255 is 0.4 in double precision, and a little less in single
        ([152, 153], {"occupied_thresh": 0.4}, [O, U]),
        ([0, 51, 255], {"occupied_thresh": 0.8, "free_thresh": 0.8}, [O, F, F]),
        ([254], {}, [F]),
        ([100], {"mode": "Raw"}, [O]),
    ],
    ids=["negate", "on both thresholds", "single precision", "free wins", "no mode", "capitals"],
)
def test_negate_mode_and_thresholds_decide_as_in_the_map_server(
    tmp_path: Path, greys: list[int], changes: dict[str, object], cells: list[int]
) -> None:
    assert grid_of(write_map(tmp_path, [greys], **changes)).cells.tolist() == [cells]


def test_scale_spreads_the_greys_between_the_thresholds(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[255, 204, 127, 1, 0]], mode="scale", occupied_thresh=1.0, free_thresh=0.0)
    assert occupancy_of(path).tolist() == [[0, 20, 50, 100, 100]]
    path = write_map(tmp_path, [[255, 203, 127, 1, 0]], mode="scale", occupied_thresh=0.9, free_thresh=0.1)
    assert occupancy_of(path).tolist() == [[0, 13, 50, 100, 100]]  # 100 * (0.2039 - 0.1) / 0.8 = 12.99


def test_only_100_is_an_obstacle_in_scale_with_a_warning(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[255, 127, 3, 0]], mode="scale", occupied_thresh=1.0, free_thresh=0.0)
    reading = read_nav2(path)
    assert occupancy_of(path).tolist() == [[0, 50, 99, 100]]
    assert reading.grid.cells.tolist() == [[F, F, F, O]]
    assert "2 cells with an occupancy between 1 and 99 became free" in reading.warnings


def test_raw_takes_the_byte_and_leaves_thresholds_negate_and_alpha_alone(tmp_path: Path) -> None:
    greys = np.array([[0, 1, 100, 101, 205, 255]], dtype=np.uint8)
    path = write_map(tmp_path, greys, mode="raw", negate=1)
    assert occupancy_of(path).tolist() == [[0, 1, 100, -1, -1, -1]]
    assert grid_of(path).cells.tolist() == [[F, F, O, U, U, U]]
    path = write_map(tmp_path, np.dstack([greys, greys, greys, greys * 0]), mode="raw", image="map.png")
    assert occupancy_of(path).tolist() == [[0, 1, 100, -1, -1, -1]]


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_pixels_that_are_not_opaque_are_unknown(tmp_path: Path, mode: str) -> None:
    grey = np.array([[255, 255, 0, 0]], dtype=np.uint8)
    alpha = np.array([[255, 254, 0, 255]], dtype=np.uint8)
    path = write_map(tmp_path, np.dstack([grey, grey, grey, alpha]), mode=mode, image="map.png")
    assert occupancy_of(path).tolist() == [[0, -1, -1, 100]]
    reading = read_nav2(path)
    assert reading.grid.cells.tolist() == [[F, U, U, O]]
    assert "2 pixels are transparent and became unknown" in reading.warnings
    assert reading.legend == (
        LegendEntry(symbol="grey 0", code=OBSTACLE, cells=1),
        LegendEntry(symbol="grey 255", code=FLOOR, cells=1),
        LegendEntry(symbol="transparent", code=UNKNOWN, cells=2),
    )


def test_an_alpha_channel_that_older_map_servers_read_otherwise_is_named(tmp_path: Path) -> None:
    # The mean of 205, 205, 205 and 255 is 217.5: p = 0.147 is free to them. Black, p = 0.75, stays an obstacle.
    for greys, cells in (([[255, 205, 205, 0]], 2), ([[255, 255, 0, 0]], 0)):
        grey = np.array(greys, dtype=np.uint8)
        path = write_map(tmp_path, np.dstack([grey, grey, grey, np.full_like(grey, 255)]), image="map.png")
        told = [text for text in read_nav2(path).warnings if "Jazzy" in text]
        assert [f"reads {cells} opaque pixels otherwise" in text for text in told] == [True] * bool(cells)


# Kinds of image


def test_rgb_images_of_greys_read_like_grey_images(tmp_path: Path) -> None:
    grey = np.array([[254, 0, 205]], dtype=np.uint8)
    reading = read_nav2(write_map(tmp_path, np.dstack([grey] * 3), image="map.png"))
    assert reading.grid.cells.tolist() == [[F, O, U]]
    assert reading.warnings == ()


def test_colours_are_converted_by_luma_with_a_warning(tmp_path: Path) -> None:
    # Rec. 709: red 54, green 182, blue 18; a mean of the channels would make all three 85.
    colours = [[[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]]]
    reading = read_nav2(write_map(tmp_path, colours, image="map.png"))
    assert [entry.symbol for entry in reading.legend] == ["grey 18", "grey 54", "grey 182", "grey 255"]
    assert reading.grid.cells.tolist() == [[O, U, O, F]]
    assert any("3 of its pixels are coloured" in warning for warning in reading.warnings)


def test_palettes_bitmaps_and_16_bit_greys_are_read(tmp_path: Path) -> None:
    grey = np.array([[255, 0]], dtype=np.uint8)
    path = write_map(tmp_path, grey, image="map.png")
    for image in (*map(Image.fromarray(grey).convert, ("P", "1", "LA")), Image.fromarray(grey.astype(np.uint16) * 257)):
        image.save(tmp_path / "map.png")
        assert grid_of(path).cells.tolist() == [[F, O]], image.mode


def test_a_plain_pgm_with_another_white_and_a_comment_is_read(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[0]])
    (tmp_path / "map.pgm").write_text("P2\n# a comment\n3 1\n100\n100 0 80")  # no newline at the end
    assert [entry.symbol for entry in read_nav2(path).legend] == ["grey 0", "grey 204", "grey 255"]


def test_a_binary_pgm_with_comments_and_one_of_16_bits_are_read(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[0]])
    (tmp_path / "map.pgm").write_bytes(b"P5\n# CREATOR: map saver 0.05 m/pix\n3 1 # size\n255\n\xfe\x00\xcd")
    assert grid_of(path).cells.tolist() == [[F, O, U]]
    (tmp_path / "map.pgm").write_bytes(b"P5\n3 1\n65535\n\xfe\xfe\x00\x00\xcd\xcd")
    assert grid_of(path).cells.tolist() == [[F, O, U]]


def test_a_jpeg_is_read_with_a_warning(tmp_path: Path) -> None:
    path = write_map(tmp_path, np.full((8, 8), 255), image="map.jpg")
    reading = read_nav2(path)
    assert np.all(reading.grid.cells == FLOOR)
    assert any("JPEG" in warning for warning in reading.warnings)


# Maps that mean something else


def test_a_free_threshold_that_makes_unknown_free_is_named(tmp_path: Path) -> None:
    reading = read_nav2(write_map(tmp_path, [[254, 205, 205, 0]], free_thresh=0.25))
    assert reading.grid.cells.tolist() == [[F, F, F, O]]
    assert reading.warnings == (
        "grey 205 became free in 2 cells (0.5 m2, 50.0%), yet map savers write grey 205 for unknown: "
        "check free_thresh (0.25); 0.196 would leave them unknown",
    )


@pytest.mark.parametrize("grey", range(200, 211))
def test_the_threshold_that_is_advised_does_leave_the_grey_unknown(tmp_path: Path, grey: int) -> None:
    (warning,) = read_nav2(write_map(tmp_path, [[grey]], free_thresh=0.25)).warnings
    advised = float(re.findall(r"([0-9.]+) would leave", warning)[0])
    assert grid_of(write_map(tmp_path, [[grey]], free_thresh=advised)).cells.tolist() == [[U]]


def test_the_blur_of_an_edge_is_no_reason_for_a_warning(tmp_path: Path) -> None:
    pixels = np.full((100, 100), 254)
    pixels[0, :4] = 207
    assert read_nav2(write_map(tmp_path, pixels)).warnings == ()


@pytest.mark.parametrize(
    ("greys", "negate", "told"),
    [
        ([205, 0], 1, "grey 205 became obstacle in 1 cell "),
        ([255, 222, 222, 0], 0, "greys 222 (50.0%) and 255 (25.0%) both became free"),
        ([255, 230, 230, 0], 0, "greys 230 (50.0%) and 255 (25.0%) both became free"),
        ([255, 127, 203, 203], 0, "greys 127 (25.0%) and 203 (50.0%) both became unknown"),
    ],
    ids=["negated unknown", "222 for unknown", "230 for unknown", "a grey wall"],
)
def test_a_grey_that_became_something_else_is_named(tmp_path: Path, greys: list[int], negate: int, told: str) -> None:
    (warning,) = read_nav2(write_map(tmp_path, [greys], negate=negate)).warnings
    assert warning.startswith(told)


@pytest.mark.parametrize("unknown", [153, 203])
def test_greys_that_are_unknown_anyway_are_no_reason_for_a_warning(tmp_path: Path, unknown: int) -> None:
    assert read_nav2(write_map(tmp_path, [[255, unknown, unknown, 0]])).warnings == ()


# Real maps

FREE_M2 = {
    "fr079": 322, "fr079_step02": 208, "fr079_step10": 356, "fr079_step15": 404, "fr101": 157, "cartesium": 457,
    "tsc_office": 2418, "tsc_office_nogo": 2252, "warehouse_aws": 234, "warehouse_nav2": 1280,
    "warehouse_nav2_keepout": 1249, "depot_nav2": 449, "tb3_sandbox": 20, "diag_floor1": 817,
}  # fmt: skip


@pytest.mark.parametrize("name", [*FREE_M2, "depot_nav2_fixed", "warehouse_nav2_speed"])
def test_real_maps_have_the_cells_that_the_rule_says(shared_maps: Path, name: str) -> None:
    path = shared_maps / f"{name}.yaml"
    header = yaml.safe_load(path.read_text())
    with Image.open(shared_maps / header["image"]) as image:
        pixels = np.asarray(image).astype(np.float32)
    p = 1 - (pixels if pixels.ndim == 2 else pixels.mean(axis=2)) / np.float32(255)
    low, high = np.float32(header["free_thresh"]), np.float32(header["occupied_thresh"])
    free = p <= low if header.get("mode") != "scale" else p < high
    grid = grid_of(path)
    assert p.dtype == np.float32
    assert grid.cells.shape == p.shape
    assert np.array_equal(grid.cells == FLOOR, free[::-1])
    assert np.array_equal(grid.cells == OBSTACLE, (p >= high)[::-1])
    if name in FREE_M2:
        assert np.count_nonzero(free) * grid.cell_area_m2 == pytest.approx(FREE_M2[name], abs=0.5)


def test_the_real_depot_map_warns_of_its_threshold_and_its_repaired_twin_does_not(shared_maps: Path) -> None:
    (warning,) = read_nav2(shared_maps / "depot_nav2.yaml").warnings
    assert warning.startswith("grey 205 became free in 8894 cells (22.24 m2")
    assert read_nav2(shared_maps / "depot_nav2_fixed.yaml").warnings == ()


def test_of_a_scale_map_s_greys_no_threshold_makes_unknown(tmp_path: Path) -> None:
    (tmp_path / "speed.pgm").write_bytes(b"P5 3 1 255\n" + bytes([0, 205, 254]))
    path = tmp_path / "speed.yaml"
    path.write_text(
        "image: speed.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\nmode: scale\n"
        "occupied_thresh: 1.0\nfree_thresh: 0.0\n"
    )
    (warning,) = [text for text in read_nav2(path).warnings if "map savers" in text]
    assert warning.endswith("map savers write grey 205 for unknown: in mode scale only transparent pixels are unknown")
