from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import marsupial
from benchmarks.storm.oracle import Oracle

WORLD: dict[str, Any] = {
    "format": "marsupial-scenario",
    "version": 1,
    "name": "two rooms",
    "map": {"resolution_m": 1.0, "rows": ["##########", "#....#~~~#", "#....~~~~#", "#....#~~~#", "##########"]},
    "robot_types": [
        {"name": "carrier", "role": "carrier", "speed_mps": 1.0, "sensor_range_m": 4, "radius_m": 0.4,
         "terrains": ["floor"], "capacity": 1},
        {"name": "rover", "role": "rover", "speed_mps": 0.5, "sensor_range_m": 2, "radius_m": 0.1,
         "terrains": ["floor", "rough"], "dock_s": 10, "undock_s": 5},
    ],
    "team": [
        {"name": "c1", "type": "carrier", "start": [1.5, 1.5]},
        {"name": "r1", "type": "rover", "carrier": "c1"},
    ],
    "goal": {"recover_rovers": True, "return_home": True},
    "limits": {"time_s": 600},
}  # fmt: skip

Lines = list[dict[str, Any]]


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> tuple[Lines, dict[str, Any]]:
    """Run a mission in which the rover is set down and fetched; return its log's lines and its summary."""
    folder = tmp_path_factory.mktemp("storm")
    (folder / "world.json").write_text(json.dumps(WORLD))
    log = Path(folder, "log.jsonl")
    result = marsupial.explore(folder / "world.json", "heuristic", log=log)
    return [json.loads(line) for line in log.read_text().splitlines()], result.as_dict()


def judged(lines: Lines, summary: dict[str, Any]) -> str:
    return "\n".join(Oracle(WORLD, [json.dumps(line) for line in lines], summary).judge())


def first(lines: Lines, event: str, **fields: object) -> dict[str, Any]:
    found = (line for line in lines if line["event"] == event)
    return next(line for line in found if all(line["action"][key] == value for key, value in fields.items()))


def test_a_mission_as_it_was_breaks_no_rule(mission: tuple[Lines, dict[str, Any]]) -> None:
    assert judged(*mission) == ""


def jump(lines: Lines) -> None:
    first(lines, "drive")["cell"] = [3, 3]


def drive_into_the_unknown(lines: Lines) -> None:
    first(lines, "reveal")["looks"] = []


def see_a_wall_as_floor(lines: Lines) -> None:
    look = first(lines, "reveal")["looks"][0]
    look[2] = "B" + look[2][1:]


def dock_in_no_time(lines: Lines) -> None:
    late = first(lines, "end", name="dock")
    late["t_ms"] = first(lines, "start", name="dock")["t_ms"]


def drive_aboard(lines: Lines) -> None:
    drive = first(lines, "drive")
    drive["robot"] = "r1"


def claim_more_than_was_seen(lines: Lines) -> None:
    lines[-1]["explored_area_m2"] += 1


def leave_the_rover(lines: Lines) -> None:
    lines[-1]["aboard"] = []


@pytest.mark.parametrize(
    ("tamper", "finding"),
    [
        (jump, "sets out from (3, 3), but stands at"),
        (drive_into_the_unknown, "over cells that are not known yet"),
        (see_a_wall_as_floor, "where 0 is"),
        (dock_in_no_time, "took 0 ms to dock, not 10000"),
        (drive_aboard, "r1 drives aboard c1"),
        (claim_more_than_was_seen, "explored and reachable area are"),
        (leave_the_rover, "aboard are [], by the log ['r1']"),
    ],
)
def test_each_broken_rule_is_found(
    mission: tuple[Lines, dict[str, Any]], tamper: Callable[[Lines], None], finding: str
) -> None:
    lines, summary = mission
    copy: Lines = json.loads(json.dumps(lines))
    tamper(copy)
    assert finding in judged(copy, summary)
