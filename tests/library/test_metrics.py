"""The table of metrics, and its users."""

from dataclasses import fields, replace
from pathlib import Path

import pytest

import marsupial
from marsupial.bench.compare.rows import METRIC_BY_COLUMN, MissionRow, Timing
from marsupial.library.metrics import METRICS
from marsupial.model.mission import Interference

DOCUMENT = (Path(__file__).resolve().parents[2] / "docs" / "command-line.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def lobby() -> marsupial.Exploration:
    return marsupial.explore("lobby", planner="greedy", steps=1)


def test_every_number_of_the_json_is_a_metric(lobby: marsupial.Exploration) -> None:
    told = lobby.as_dict()
    named = {key.partition(".")[0] for key in METRICS}
    settings = {"status", "reason", "scenario", "strategy", "planner", "carriers", "rovers", "robots", "seed", "log"}
    by_robot = {"distance_m_per_robot", "energy_j_per_robot"}
    assert set(told) == named | settings | by_robot
    assert {f"planning_s.{name}" for name in told["planning_s"]} == {key for key in METRICS if "." in key}


def test_every_column_of_a_comparison_is_a_metric() -> None:
    columns = {each.name for kind in (MissionRow, Timing) for each in fields(kind)}
    crowding = {each.name for each in fields(Interference)}
    assert columns - set(METRIC_BY_COLUMN) == {"trial", "status", "reason", "cpu_s"} | crowding
    assert set(METRIC_BY_COLUMN) - columns == {"lost", "plans_valid"}


@pytest.mark.parametrize("key", METRICS)
def test_every_metric_is_read_shown_kept_and_explained(key: str, lobby: marsupial.Exploration) -> None:
    metric = METRICS[key]
    assert metric.key == key
    assert metric.title
    assert metric.definition
    assert metric.shown(lobby)
    assert metric.read(str(metric.cell(lobby))) == metric.cell(lobby)


def test_a_metric_that_a_mission_does_not_have_is_none(lobby: marsupial.Exploration) -> None:
    metric = METRICS["exploration_time_s"]
    without = replace(lobby, exploration_time_s=None)
    assert (metric.of(without), metric.cell(without), metric.shown(without)) == (None, None, "never done")


@pytest.mark.parametrize("key", [key for key in METRICS if "." not in key])
def test_the_readme_names_every_key(key: str) -> None:
    assert f"`{key}`" in DOCUMENT
