"""A small valid scenario file, and functions that make it invalid."""

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from marsupial.errors import ScenarioError
from marsupial.formats.scenario import read_scenario

GOOD: dict[str, Any] = {
    "format": "marsupial-scenario",
    "version": 1,
    "map": {
        "resolution_m": 1.0,
        "rows": ["########", *["#....~~#"] * 3, "########"],
    },
    "robot_types": [
        {"name": "carrier", "role": "carrier", "speed_mps": 1.0, "sensor_range_m": 10.0, "radius_m": 0.5,
         "terrains": ["floor"], "capacity": 2},
        {"name": "rover", "role": "rover", "speed_mps": 0.5, "sensor_range_m": 5.0, "radius_m": 0.1,
         "terrains": ["floor", "rough"], "dock_s": 10.0, "undock_s": 5.0},
    ],
    "team": [
        {"name": "anna", "type": "carrier", "start": [2.5, 2.5]},
        {"name": "joey", "type": "rover", "carrier": "anna"},
        {"name": "jill", "type": "rover", "start": [6.5, 1.5]},
    ],
}  # fmt: skip


def changed(**changes: Any) -> dict[str, Any]:
    """The good scenario with some fields replaced: ``team__1__type="x"`` replaces team[1].type, `...` removes it."""
    data = copy.deepcopy(GOOD)
    for path, value in changes.items():
        *parents, last = [int(key) if key.isdigit() else key for key in path.split("__")]
        place: Any = data
        for key in parents:
            place = place[key]
        if value is ...:
            del place[last]
        else:
            place[last] = value
    return data


def stored(folder: Path, data: object) -> Path:
    path = folder / "yard.yaml"
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    return path


def faults(folder: Path, data: object) -> list[str]:
    """Return the errors of a scenario, without line numbers."""
    with pytest.raises(ScenarioError) as caught:
        read_scenario(stored(folder, data))
    assert caught.value.source == str(folder / "yard.yaml")
    return [str(replace(problem, line=None)) for problem in caught.value.problems]
