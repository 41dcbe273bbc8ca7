from __future__ import annotations

from pathlib import Path

import pytest

from marsupial.errors import MapError, ScenarioError
from marsupial.formats.scenario import write_scenario
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.scenarios import load_scenario

SQUARE = "type octile\nheight 4\nwidth 4\nmap\n....\n....\n....\n....\n"


def test_a_built_in_name_has_two_carriers_with_two_rovers_each() -> None:
    scenario, warnings = load_scenario("lobby")
    assert (scenario.name, len(scenario.team), warnings) == ("lobby", 6, [])


def test_the_team_of_a_built_in_scenario_can_be_another() -> None:
    scenario, _ = load_scenario("lobby", 1, 3)
    assert [member.type for member in scenario.team] == ["carrier", "rover", "rover", "rover"]


def test_a_bare_map_gets_the_default_team(tmp_path: Path) -> None:
    path = tmp_path / "square.map"
    path.write_text(SQUARE)
    scenario, _ = load_scenario(str(path), 1)
    assert (scenario.name, len(scenario.team)) == ("square", 3)


def test_a_scenario_file_keeps_its_team_unless_told_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    write_scenario(builtin_scenario("lobby", 1, 1), path)
    assert len(load_scenario(str(path))[0].team) == 2
    assert len(load_scenario(str(path), 3)[0].team) == 6


def test_a_name_that_is_nearly_right_is_suggested() -> None:
    with pytest.raises(ScenarioError, match="ofice: neither a built-in scenario nor a file; did you mean office"):
        load_scenario("ofice")


def test_a_file_that_is_nearly_right_is_suggested(tmp_path: Path) -> None:
    (tmp_path / "square.map").write_text(SQUARE)
    with pytest.raises(ScenarioError, match=r"did you mean .*square\.map"):
        load_scenario(str(tmp_path / "sqare.map"))


def test_a_name_like_nothing_gets_the_list() -> None:
    with pytest.raises(ScenarioError, match="built in: office, maze"):
        load_scenario("xyzzy")


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(MapError, match="unknown kind of map"):
        load_scenario(str(tmp_path / "notes.txt"))
