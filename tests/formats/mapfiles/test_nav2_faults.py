"""Yaml files and images of nav2 that are wrong, or only nearly right."""

import re
from pathlib import Path

import numpy as np
import pytest
from nav2_files import HEADER, F, O, grid_of, write_map, write_yaml

from marsupial.errors import MapError
from marsupial.formats.mapfiles.nav2 import read_nav2


def fault_of(path: Path) -> MapError:
    with pytest.raises(MapError) as caught:
        grid_of(path)
    assert str(path) in str(caught.value)
    return caught.value


def problems_of(path: Path) -> dict[str, str]:
    return {problem.path: problem.message for problem in fault_of(path).problems}


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
