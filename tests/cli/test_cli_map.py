import json
from pathlib import Path

import numpy as np
import pytest

from marsupial.cli.main import main
from marsupial.formats.mapfiles.read import read_map
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN

YARD = "type octile\nheight 5\nwidth 6\nmap\n@@@@@@\n@....@\n@.@..@\n@....@\n@@@@@@\n"


@pytest.fixture
def yard(tmp_path: Path) -> str:
    path = tmp_path / "yard.map"
    path.write_text(YARD)
    return str(path)


def test_a_map_is_described_for_people(capsys: pytest.CaptureFixture[str], yard: str) -> None:
    assert main(["map", yard]) == 0
    captured = capsys.readouterr()
    assert "6 x 5 cells, 6 m x 5 m, 1 m a cell" in captured.out
    assert "rover" in captured.out
    assert "warning: rovers can stand nowhere that carriers can't" in captured.err


def test_a_map_is_described_for_programs(capsys: pytest.CaptureFixture[str], yard: str) -> None:
    assert main(["map", yard, "--json"]) == 0
    description = json.loads(capsys.readouterr().out)
    assert (description["width"], description["height"], description["free"][0]["cells"]) == (6, 5, 11)
    assert [reach["radius_m"] for reach in description["reach"]] == [0.5, 0.15]


def test_a_built_in_scenario_is_described_with_its_own_types(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["map", "lobby", "--json"]) == 0
    assert [reach["radius_m"] for reach in json.loads(capsys.readouterr().out)["reach"]] == [0.3, 0.1]


def test_a_picture_of_all_greys_takes_a_few_lines(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "shades.pgm").write_bytes(b"P5 256 4 255\n" + bytes(range(256)) * 4)
    path = tmp_path / "shades.yaml"
    path.write_text(
        "image: shades.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    assert main(["map", str(path)]) == 0
    printed = capsys.readouterr().out
    assert sum("grey" in line for line in printed.splitlines()) == 3
    assert main(["map", str(path), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["legend"]) == 256


def test_a_picture_is_shown_and_written(capsys: pytest.CaptureFixture[str], tmp_path: Path, yard: str) -> None:
    figure = tmp_path / "yard.svg"
    assert main(["map", yard, "--out", str(figure)]) == 0
    captured = capsys.readouterr()
    assert ". carriers can stand here" in captured.out
    assert captured.err.startswith(f"wrote {figure}\n")
    assert "start, drawn by seed 1" in figure.read_text()
    assert main(["map", yard, "--no-picture"]) == 0
    assert "carriers can stand here" not in capsys.readouterr().out


SCENARIO = """
format: marsupial-scenario
version: 1
name: yard
map: {{file: yard.map}}
robot_types:
  - {{name: carrier, role: carrier, speed_mps: 1.0, sensor_range_m: 5.0, radius_m: 0.3, terrains: [floor],
     capacity: 1}}
team:
  - {{name: atlas, type: carrier, start: {first}}}
  - {{name: borea, type: carrier, start: {second}}}
{rest}
"""


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({}, "start, drawn by seed 1"),
        ({"rest": "start_seed: 7"}, "start, drawn by seed 7"),
        ({"first": "[1.5, 1.5]"}, "start, given or drawn by seed 1"),
        ({"first": "[1.5, 1.5]", "second": "[3.5, 1.5]"}, "start"),
    ],
)
def test_a_picture_names_the_source_of_its_starts(tmp_path: Path, yard: str, fields: dict[str, str], told: str) -> None:
    Path(f"{yard}.scenario.yaml").write_text(
        SCENARIO.format(**{"first": "drawn", "second": "drawn", "rest": ""} | fields)
    )
    figure = tmp_path / "yard.svg"
    assert main(["map", f"{yard}.scenario.yaml", "--out", str(figure), "--no-picture"]) == 0
    assert f">{told}</text>" in figure.read_text()


@pytest.mark.parametrize(
    ("option", "name", "told"), [("--out", "yard.bmp", "can't write .bmp"), ("--clean", "a.png", "must end in .yaml")]
)
def test_a_file_of_another_kind_is_a_usage_error(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, yard: str, option: str, name: str, told: str
) -> None:
    assert main(["map", yard, "--no-picture", option, str(tmp_path / name)]) == 2
    assert told in capsys.readouterr().err


def test_a_map_is_written_without_specks_and_closed(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    hall = np.full((60, 60), 254, dtype=np.uint8)
    hall[10:50, [10, 49]] = hall[[10, 49], 10:50] = 0
    hall[30, 30] = 0
    hall[20:25, 10] = 254  # a door to the free outside
    (tmp_path / "hall.pgm").write_bytes(b"P5 60 60 255\n" + hall.tobytes())
    header = "image: hall.pgm\nresolution: 0.05\norigin: [1.5, -2, 0.25]\nnegate: 0\n"
    (tmp_path / "hall.yaml").write_text(f"{header}occupied_thresh: 0.65\nfree_thresh: 0.196\n")
    outputs = ["--clean", str(tmp_path / "clean"), "--boundary", str(tmp_path / "closed.yaml")]
    assert main(["map", str(tmp_path / "hall.yaml"), "--no-picture", *outputs]) == 0
    told = capsys.readouterr().err
    assert f"wrote {tmp_path}/clean.yaml, without 1 speck smaller than rover" in told
    clean, bounded = (read_map(tmp_path / f"{name}.yaml").grid for name in ("clean", "closed"))
    assert (clean.resolution_m, clean.origin_m) == (0.05, (1.5, -2.0, 0.25))
    assert clean.cells[29, 30] == FLOOR
    assert {int(bounded.cells[0, 0]), int(bounded.cells[37, 10])} == {UNKNOWN, OBSTACLE}
