import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from benchmarks.scenario_files import write_scenario
from marsupial.cli.main import main
from marsupial.errors import MapError, ScenarioError, UsageError
from marsupial.generators.builtin import SCENARIOS, builtin_scenario
from marsupial.library.scenarios import load_scenario, scenario
from marsupial.maps.describe import describe
from marsupial.model.grid import Cell

SQUARE = "type octile\nheight 4\nwidth 4\nmap\n....\n....\n....\n....\n"


def test_a_built_in_name_has_two_carriers_with_two_rovers_each() -> None:
    scenario = load_scenario("lobby").scenario
    assert (scenario.name, len(scenario.team)) == ("lobby", 6)


def test_the_team_of_a_built_in_scenario_can_be_another() -> None:
    scenario = load_scenario("lobby", 1, 3).scenario
    assert [member.type for member in scenario.team] == ["carrier", "rover", "rover", "rover"]


def test_a_bare_map_gets_the_default_team(tmp_path: Path) -> None:
    path = tmp_path / "square.map"
    path.write_text(SQUARE)
    scenario = load_scenario(str(path), 1).scenario
    assert (scenario.name, len(scenario.team)) == ("square", 3)


def test_a_scenario_file_keeps_its_team_unless_told_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    write_scenario(builtin_scenario("lobby", 1, 1), path)
    assert len(load_scenario(str(path)).scenario.team) == 2
    assert len(load_scenario(str(path), 3).scenario.team) == 6


@pytest.mark.parametrize("name", SCENARIOS)
def test_maps_of_built_in_scenarios_have_no_warnings(name: str) -> None:
    built_in = builtin_scenario(name)
    assert describe(built_in.grid, built_in.robot_types).warnings == ()
    assert load_scenario(name).warnings() == []


def test_warnings_about_a_map_are_shown_for_bare_maps_and_scenario_files(tmp_path: Path) -> None:
    (tmp_path / "square.map").write_text(SQUARE)
    path = tmp_path / "mine.yaml"
    write_scenario(builtin_scenario("lobby", 1, 1), path)
    fields = yaml.safe_load(path.read_text()) | {"map": {"file": "square.map"}}
    path.write_text(yaml.safe_dump(fields))
    for source in (tmp_path / "square.map", path):
        scale, walls, *_ = load_scenario(str(source)).warnings()
        assert scale.startswith(f"{source}: MovingAI maps have no scale: a cell counts as 1 m")
        assert walls == f"{source}: there is no obstacle: no wall was recognised"
    fields["map"]["resolution_m"] = 0.5
    path.write_text(yaml.safe_dump(fields))
    loaded = load_scenario(str(path))
    assert loaded.scenario.grid.resolution_m == 0.5
    assert not any("scale" in text for text in loaded.warnings())


def test_robots_that_start_on_the_same_cell_are_warned_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.yaml"
    write_scenario(builtin_scenario("lobby"), path)
    x_m, y_m = builtin_scenario("lobby").grid.centre_m(Cell(20, 20))
    starts = {"a": x_m, "b": x_m + 0.01, "c": x_m + 1}
    team = [{"name": name, "type": "carrier", "start": [x, y_m]} for name, x in starts.items()]
    team += [{"name": "r", "type": "rover", "carrier": "a"}, {"name": "s", "type": "rover", "carrier": "b"}]
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | {"team": team}))
    told = f"a, b start on the same cell, at [{x_m:g}, {y_m:g}] m: no two robots can stand there"
    assert load_scenario(str(path)).warnings() == [f"{path}: {told}"]
    assert main(["map", str(path)]) == 0
    assert capsys.readouterr().err.count(told) == 1


def test_robots_on_different_cells_and_drawn_starts_cause_no_warning(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    write_scenario(builtin_scenario("lobby", 2, 2), path)
    assert load_scenario(str(path)).warnings() == []


def test_a_file_that_is_nearly_right_is_suggested_and_one_of_another_kind_refused(tmp_path: Path) -> None:
    (tmp_path / "square.map").write_text(SQUARE)
    with pytest.raises(ScenarioError, match=r"did you mean .*square\.map"):
        load_scenario(str(tmp_path / "sqare.map"))
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(MapError, match="unknown kind of map"):
        load_scenario(str(tmp_path / "notes.txt"))


def test_an_array_is_a_map_with_the_default_team() -> None:
    yard = np.pad(np.ones((40, 60), dtype=int), 1)
    yard[10:30, 30] = 0
    yard[1, 1] = 255
    found = scenario(yard, carriers=1, rovers=1, resolution_m=0.25)
    assert (found.grid.resolution_m, len(found.team)) == (0.25, 2)
    assert np.array_equal(found.grid.cells, yard)
    free = scenario(yard == 1, resolution_m=0.25).grid.cells
    assert free[1, 1] == free[10, 30] == 0


@pytest.mark.parametrize(
    ("given", "resolution_m", "message"),
    [
        (np.ones((4, 4), dtype=int), None, "resolution_m: an array needs the edge of its cells in metres"),
        (np.ones((4, 4), dtype=int), 0, "resolution_m: must be positive, got 0"),
        (np.ones((4, 4)), 0.1, r"must be a 2-d array of whole numbers, got float64 \(4, 4\)"),
        (np.ones(4, dtype=int), 0.1, r"must be a 2-d array of whole numbers, got int64 \(4,\)"),
        (np.full((4, 4), 100), 0.1, "cells must be 0 obstacle, 1 floor, 2 rough or 255 unknown, got 100"),
        ("office", 0.1, "office: has cells of its own size"),
    ],
)
def test_what_makes_no_map_is_refused(given: Any, resolution_m: float | None, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        scenario(given, resolution_m=resolution_m)


def test_the_command_takes_an_image_with_its_resolution(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = tmp_path / "plan.png"
    Image.fromarray(np.full((40, 60), 254, dtype=np.uint8)).save(plan)
    assert main(["run", str(plan), "--strategy", "heuristic"]) == 3
    assert "{image: plan.png, resolution: 0.05" in capsys.readouterr().err
    assert main(["run", str(plan), "--strategy", "heuristic", "--resolution", "0.1", "--json"]) == 0
    assert 20 < json.loads(capsys.readouterr().out)["explored_area_m2"] <= 24
    assert main(["map", str(plan), "--resolution", "0.1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["width_m"] == pytest.approx(6)
    assert main(["run", str(plan), "--resolution", "0"]) == 2
    assert main(["map", "office", "--resolution", "0.1"]) == 2
