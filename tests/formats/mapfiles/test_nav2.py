import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import yaml
from PIL import Image

from marsupial.errors import MapError
from marsupial.formats.mapfiles.images import read_grey
from marsupial.formats.mapfiles.nav2 import Mode, occupancy_table, read_header, read_nav2
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, Grid, LegendEntry

HEADER = {
    "image": "map.pgm", "resolution": 0.5, "origin": [1.0, 2.0, 0.25], "negate": 0, "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}  # fmt: skip

F, O, U = FLOOR, OBSTACLE, UNKNOWN  # noqa: E741


def grid_of(path: Path) -> Grid:
    return read_nav2(path).grid


def occupancy_of(path: Path) -> npt.NDArray[np.int8]:
    """Return -1 for unknown or 0 to 100 for each cell, as `nav_msgs/OccupancyGrid` does."""
    header = read_header(path)
    image = read_grey(header.image)
    data = occupancy_table(header)[image.grey]
    if image.opaque is not None and header.mode is not Mode.RAW:
        data[~image.opaque] = -1
    return np.flipud(data)


def write_map(folder: Path, pixels: npt.ArrayLike, *, drop: tuple[str, ...] = (), **changes: object) -> Path:
    """Write image and yaml (fields changed or dropped); return the yaml's path."""
    header = {key: value for key, value in (HEADER | changes).items() if key not in drop}
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(folder / Path(str(header.get("image", "map.pgm"))).name)
    return write_yaml(folder, header)


def write_yaml(folder: Path, header: Mapping[str, object]) -> Path:
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(dict(header)))
    return path


def fault_of(path: Path) -> MapError:
    with pytest.raises(MapError) as caught:
        grid_of(path)
    assert str(path) in str(caught.value)
    return caught.value


def problems_of(path: Path) -> dict[str, str]:
    return {problem.path: problem.message for problem in fault_of(path).problems}


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


# Files that are wrong


def test_an_absolute_path_is_followed_and_a_relative_one_starts_at_the_yaml_not_at_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    images = tmp_path / "images"
    images.mkdir()
    write_map(images, [[254]])
    monkeypatch.chdir(images)
    for image in (str(images / "map.pgm"), "images/map.pgm"):
        assert grid_of(write_yaml(tmp_path, HEADER | {"image": image})).cells.tolist() == [[F]]


def test_an_absolute_path_of_another_machine_is_named_with_the_image_beside_the_yaml(tmp_path: Path) -> None:
    write_map(tmp_path, [[254]])
    path = write_yaml(tmp_path, HEADER | {"image": "/home/nobody/maps/map.pgm"})
    assert problems_of(path) == {
        "image": "no such file: /home/nobody/maps/map.pgm (an absolute path; map.pgm stands beside the yaml: "
        "write `image: map.pgm`)"
    }


def test_all_missing_keys_are_named_at_once(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("mode: trinary\n")
    problems = problems_of(tmp_path / "map.yaml")
    keys = ("image", "resolution", "origin", "negate", "free_thresh", "occupied_thresh")
    assert problems == dict.fromkeys(keys, "missing")


def test_all_wrong_values_are_named_at_once_with_the_missing_image(tmp_path: Path) -> None:
    header = {"image": "gone.pgm", "resolution": -1, "origin": [0, 0], "negate": "perhaps", "mode": "binary"}
    path = write_yaml(tmp_path, header | {"free_thresh": "low", "occupied_thresh": 65})
    assert problems_of(path) == {
        "image": f"no such file: {tmp_path / 'gone.pgm'}",
        "resolution": "must be positive, got -1",
        "origin": "must be a list of 3 numbers, got [0, 0]",
        "negate": "must be an integer, got 'perhaps'",
        "free_thresh": "must be a number, got 'low'",
        "occupied_thresh": "must be at most 1, got 65",
        "mode": "must be trinary or scale or raw, got 'binary', did you mean 'trinary'?",
    }


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("image", 7, "must be a text, got 7"),
        ("image", "", "must be a text, got ''"),
        ("resolution", True, "must be a number, got true"),
        ("resolution", "0,05", "must be a number, got '0,05', did you mean 0.05?"),
        ("resolution", float("nan"), "must be finite, got nan"),
        ("resolution", 10**400, "must be finite, got 1000000"),
        ("origin", 0.0, "must be a list of 3 numbers, got 0.0"),
        ("origin", [-1, 0, -2, 0, 0, 0], "must be a list of 3 numbers, got [-1, 0, -2, 0, 0, 0]; a comma separates"),
        ("negate", 0.0, "must be an integer, got 0.0"),
        ("mode", None, "must be a text, got nothing"),
        ("image", ".", "is a directory"),
        ("negate", "9" * 5000, "must be an integer, got '999"),
        ("free_thresh", 0.7, "must not be above occupied_thresh (0.65), got 0.7"),
    ],
)
def test_wrong_values_are_named(tmp_path: Path, key: str, value: object, message: str) -> None:
    write_map(tmp_path, [[254]])
    assert problems_of(write_yaml(tmp_path, HEADER | {key: value}))[key].startswith(message)


@pytest.mark.parametrize(
    ("numbers", "place", "message"),
    [
        ('[0, "x", 0]', 1, "must be a number, got 'x'"),
        ('["-1,5", 0, 0]', 0, "must be a number, got '-1,5', did you mean -1.5?"),
        ("[0, .inf, 0]", 1, "must be finite, got inf"),
        ("[0, 0, .nan]", 2, "must be finite, got nan: write 0, as the map saver got an orientation of all zeros"),
        ("[0, 0, -nan]", 2, "must be finite, got nan: write 0, as the map saver got an orientation of all zeros"),
    ],
)
def test_a_wrong_number_in_a_list_is_named_by_its_place(tmp_path: Path, numbers: str, place: int, message: str) -> None:
    path = write_map(tmp_path, [[254]])
    path.write_text(re.sub("origin:.*(\n- .*)*", f"origin: {numbers}", path.read_text()))
    assert problems_of(path) == {f"origin[{place}]": message}


@pytest.mark.parametrize("key", ["resolution", "image", "mode", "negate"])
def test_a_field_given_twice_is_refused_with_its_line(tmp_path: Path, key: str) -> None:
    path = write_map(tmp_path, [[254]], mode="trinary")
    lines = path.read_text().splitlines()
    (again,) = (line for line in lines if line.startswith(f"{key}:"))
    path.write_text("\n".join([*lines, f'"{key}":{again.partition(":")[2]}', ""]))
    assert f"line {len(lines) + 1}, column 1: field '{key}' is given twice" in str(fault_of(path))


@pytest.mark.parametrize(
    ("written", "file", "advice"),
    [
        ("maps/map.pgm", "map.pgm", "map.pgm"),
        ("~/map.pgm", "map.pgm", "map.pgm"),
        ("maps\\map.pgm", "map.pgm", "map.pgm"),
        ("C:\\robot\\maps\\map.pgm", "maps/map.pgm", "maps/map.pgm"),
        ("Map.PGM", "map.pgm", "map.pgm"),
        ("../maps/MAP.pgm", "map.pgm", "map.pgm"),
        ("maps/map.pgm", "map.png", "map.png"),
    ],
)
def test_the_image_that_a_wrong_path_means_is_named(tmp_path: Path, written: str, file: str, advice: str) -> None:
    folder = tmp_path / "saved"
    (folder / file).parent.mkdir(parents=True)
    (folder / file).write_bytes(b"P5 1 1 255\n\xfe")
    message = problems_of(write_yaml(folder, HEADER | {"image": written}))["image"]
    assert message.startswith("no such file: ")
    assert message.endswith(f"({advice} stands beside the yaml: write `image: {advice}`)")


def test_an_image_in_the_home_folder_is_named_by_its_whole_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "map.pgm").write_bytes(b"P5 1 1 255\n\xfe")
    message = problems_of(write_yaml(tmp_path, HEADER | {"image": "~/map.pgm"}))["image"]
    assert message.endswith(f"write `image: {tmp_path / 'home' / 'map.pgm'}`)")


def test_a_typo_in_a_field_name_is_reported_with_its_line(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[254]])
    path.write_text(path.read_text().replace("resolution:", "resolutoin:").replace("free_thresh:", "free_threshold:"))
    lines = path.read_text().splitlines()
    told = {problem.path: problem for problem in fault_of(path).problems}
    assert told.keys() == {"resolution", "resolutoin", "free_thresh", "free_threshold"}
    for meant, written in (("resolution", "resolutoin"), ("free_thresh", "free_threshold")):
        assert told[meant].message == "missing"
        assert told[written].message == f"unknown field, did you mean {meant!r}?"
        assert lines[(told[written].line or 0) - 1].startswith(written)
    assert f"{path}: line " in str(fault_of(path))


def test_a_typo_in_the_mode_is_a_warning_as_the_map_server_ignores_it(tmp_path: Path) -> None:
    (warning,) = read_nav2(write_map(tmp_path, [[254]], drop=("mode",), moode="raw")).warnings
    assert re.fullmatch(r"line \d: moode: unknown field, did you mean 'mode'\?; it is ignored", warning)


@pytest.mark.parametrize("key", ["free_thresh", "occupied_thresh"])
def test_a_threshold_in_percent_gets_a_hint(tmp_path: Path, key: str) -> None:
    path = write_map(tmp_path, [[254]], **{key: "65%"})
    assert problems_of(path) == {key: "must be a share from 0 to 1 without a percent sign, as 0.65, got '65%'"}


@pytest.mark.parametrize(("written", "negated"), [("y", True), ("N", False), ('"1"', True), ("on", True), ("0", False)])
def test_negate_is_read_as_the_map_server_reads_it(tmp_path: Path, written: str, negated: bool) -> None:
    path = write_map(tmp_path, [[254, 0]], drop=("negate",))
    path.write_text(path.read_text() + f"negate: {written}\n")
    assert grid_of(path).cells.tolist() == [[O, F] if negated else [F, O]]


def test_a_number_without_a_point_in_its_mantissa_is_a_number(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[254]])
    path.write_text(path.read_text().replace("resolution: 0.5", "resolution: 5e-2"))
    assert grid_of(path).resolution_m == 0.05


def test_extra_keys_crlf_and_a_missing_final_newline_are_accepted(tmp_path: Path) -> None:
    path = write_map(tmp_path, [[254]], elevation_image="x.pgm", cost_scaling={"a": [1, 2]})
    path.write_bytes(path.read_bytes().rstrip().replace(b"\n", b"\r\n"))
    assert grid_of(path).cells.tolist() == [[F]]


@pytest.mark.parametrize("text", ["", "- a\n- b\n", "just text", "42"])
def test_a_yaml_that_is_no_mapping_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "map.yaml").write_text(text)
    assert problems_of(tmp_path / "map.yaml")[""].startswith("must hold" if text else "is empty")


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"a: b: c", ""),
        (b"image: \x00", ""),
        (b"image: \xff\xfe\xc3(", ""),
        (b"image: !!python/object/apply:os.getcwd []", ""),
        pytest.param(b"[" * 5000, "", id="5000 brackets"),
        (b"image: a.pgm\n\tresolution: 1", ": line 2, column 1: a tab can't stand here: YAML is indented"),
        (b"image: [a.pgm\n", ": line 2, column 1: did not find expected ',' or ']'"),
    ],
)
def test_broken_yaml_is_refused_with_its_place(tmp_path: Path, data: bytes, told: str) -> None:
    (tmp_path / "map.yaml").write_bytes(data)
    assert problems_of(tmp_path / "map.yaml")[""].startswith(f"is not valid YAML{told}")


def test_a_yaml_bomb_is_refused(tmp_path: Path) -> None:
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}" for i in range(1, 30)]
    (tmp_path / "map.yaml").write_text("\n".join(lines))
    assert "aliases and tags are not allowed" in problems_of(tmp_path / "map.yaml")[""]


def test_an_oversized_yaml_is_refused(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("# filler\n" * 10_000)
    assert problems_of(tmp_path / "map.yaml")[""] == "has 90000 bytes, more than the limit of 65536"


@pytest.mark.parametrize("name", ["map.pgm", "map.png"])
def test_a_truncated_image_is_named(tmp_path: Path, name: str) -> None:
    path = write_map(tmp_path, np.arange(10_000).reshape(100, 100) % 251, image=name)
    image = tmp_path / name
    image.write_bytes(image.read_bytes()[: image.stat().st_size // 2])
    assert problems_of(path)["image"].startswith("can't be decoded (")


@pytest.mark.parametrize(
    ("image", "told"),
    [
        (b"hello", "is not a PNG, PGM, BMP or JPEG image: "),
        (b"Pf\n1 1\n-1.0\n" + np.float32(0.5).tobytes(), "pixel format F"),
        (b"P5 20000 20000 255\n", "100000000"),
        (b"P5 9500 10600 255\n", "100000000"),
    ],
    ids=["no image", "floating point", "too big by its header", "not much too big"],
)
def test_an_image_that_cant_be_taken_is_refused(tmp_path: Path, image: bytes, told: str) -> None:
    (tmp_path / "map.pgm").write_bytes(image)
    assert told in problems_of(write_yaml(tmp_path, HEADER))["image"]


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
