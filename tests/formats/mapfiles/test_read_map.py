import os
import pwd
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from marsupial.errors import MapError
from marsupial.formats.mapfiles.read import READERS, read_map
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN

YAML = "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


def error_of(path: Path | str) -> str:
    with pytest.raises(MapError) as caught:
        read_map(path)
    return str(caught.value)


@pytest.mark.parametrize("name", ["map.yaml", "map.yml", "map.YAML"])
def test_a_yaml_is_a_nav2_map(tmp_path: Path, name: str) -> None:
    (tmp_path / "map.pgm").write_bytes(b"P5 2 1 255\n\xfe\x00")
    (tmp_path / name).write_text(YAML)
    reading = read_map(str(tmp_path / name))
    assert reading.format == "nav2 map, trinary, image map.pgm"
    assert (reading.grid.width, reading.walled) == (2, False)


def test_a_map_is_a_movingai_map(tmp_path: Path) -> None:
    (tmp_path / "a.map").write_text("type octile\nheight 1\nwidth 2\nmap\n.@\n")
    reading = read_map(tmp_path / "a.map")
    assert (reading.format, reading.grid.width, reading.walled) == ("MovingAI map, 1 m a cell", 2, True)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    assert error_of(tmp_path / "gone.yaml") == f"{tmp_path / 'gone.yaml'}: no such file"
    (tmp_path / "file").touch()
    assert error_of(tmp_path / "file" / "a.map").endswith(": no such file")


@pytest.mark.parametrize("suffix", READERS)
def test_a_directory_is_named(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"a{suffix}").mkdir()
    assert "is a directory, not a file, and holds no recording" in error_of(tmp_path / f"a{suffix}")


def test_a_file_of_another_kind_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.txt").touch()
    assert "unknown kind of map '.txt': must be a nav2 map" in error_of(tmp_path / "a.txt")


def test_an_image_is_refused_with_the_yaml_to_write_or_to_give(tmp_path: Path) -> None:
    image = tmp_path / "a.pgm"
    Image.fromarray(np.full((4, 6), 254, dtype=np.uint8)).save(image)
    error = error_of(image)
    assert "--resolution 0.05" in error
    image.with_suffix(".yaml").write_text(error.partition("give that: ")[2])
    assert read_map(image.with_suffix(".yaml")).grid.resolution_m == 0.05
    image.with_suffix(".yaml").touch()
    assert error_of(image).endswith(f"is the image of a map: give its yaml file, {tmp_path / 'a.yaml'}")


def test_an_image_is_a_map_with_the_size_of_its_cells(tmp_path: Path) -> None:
    grey = np.array([[0, 254, 205], [254, 254, 0]], dtype=np.uint8)
    Image.fromarray(grey).save(tmp_path / "a.png")
    grid = read_map(tmp_path / "a.png", 0.1).grid
    assert (grid.resolution_m, grid.cells.tolist()) == (0.1, [[FLOOR, FLOOR, OBSTACLE], [OBSTACLE, FLOOR, UNKNOWN]])


PROBLEMS = "version 1\n0\tmaps/yard.map\t49\t49\t1\t11\t1\t12\t1\n"


@pytest.mark.parametrize(
    ("scenario", "text", "beside", "told"),
    [
        ("yard.map.scen", "", "yard.map", "yard.map"),
        ("yard-even-1.scen", PROBLEMS, "yard.map", "yard.map"),
        ("yard-even-1.scen", PROBLEMS, "other.map", "maps/yard.map"),
        ("yard.scen", "\0\1\2", "other.map", "a .map file"),
    ],
)
def test_path_problems_are_refused_with_the_map_to_give(
    tmp_path: Path, scenario: str, text: str, beside: str, told: str
) -> None:
    (tmp_path / scenario).write_text(text)
    (tmp_path / beside).touch()
    place = str(tmp_path / told) if told == beside else told
    assert error_of(tmp_path / scenario) == (
        f"{tmp_path / scenario}: holds MovingAI path problems for single agents, not a map: "
        f"give the map they are for, {place}"
    )


def test_a_map_without_scale_may_be_given_one(tmp_path: Path) -> None:
    (tmp_path / "a.map").write_text("type octile\nheight 1\nwidth 2\nmap\n.@\n")
    reading = read_map(tmp_path / "a.map", 0.25)
    assert (reading.format, reading.grid.resolution_m, reading.warnings) == ("MovingAI map, 0.25 m a cell", 0.25, ())
    assert "a cell counts as 1 m here" in read_map(tmp_path / "a.map").warnings[0]


def test_a_pipe_is_refused_and_never_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.map")
    assert error_of(tmp_path / "a.map").endswith("is not a regular file")


def test_an_unreadable_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.map"
    path.touch(mode=0o000)
    root = os.geteuid() == 0  # who may read every file
    if root:
        os.seteuid(pwd.getpwnam("nobody").pw_uid)
    try:
        assert error_of(path).endswith("can't be read (permission denied)")
    finally:
        if root:
            os.seteuid(0)


@pytest.mark.parametrize("name", ["a\0b.map", "a" * 5000 + ".map"], ids=["null byte", "long name"])
def test_impossible_names_are_refused(name: str) -> None:
    assert "can't be read" in error_of(name)


def test_every_real_map_is_read(shared_maps: Path) -> None:
    paths = [*shared_maps.glob("*.yaml"), *shared_maps.glob("movingai/*.map")]
    assert len(paths) == 24
    for path in paths:
        reading = read_map(path)
        assert sum(entry.cells for entry in reading.legend) == reading.grid.cells.size
