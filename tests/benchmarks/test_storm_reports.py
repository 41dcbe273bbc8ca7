"""The storm's rules for missions whose robots report their own map: what is wrong with a log is found."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.storm.account import ReportedMission
from benchmarks.storm.distortion import MOST_LATE_MS, Distortion, Mapper
from benchmarks.storm.ground import UNKNOWN, drawn_cells
from benchmarks.storm.oracle import judge_reported
from benchmarks.storm.reporting import ReportingTeam
from marsupial.formats.scenario.read import read_scenario
from marsupial.mission.placement import place_team
from marsupial.model import Budget

ROWS = ["############", "#....#.....#", "#..........#", "#....#.....#", "############"]

WORLD: dict[str, Any] = {
    "format": "marsupial-scenario",
    "version": 1,
    "name": "two rooms",
    "map": {"resolution_m": 1.0, "rows": ROWS},
    "robot_types": [
        {"name": "carrier", "role": "carrier", "speed_mps": 1.0, "sensor_range_m": 4, "radius_m": 0.4,
         "terrains": ["floor"], "capacity": 1},
        {"name": "rover", "role": "rover", "speed_mps": 0.5, "sensor_range_m": 3, "radius_m": 0.1,
         "terrains": ["floor"], "dock_s": 10, "undock_s": 5},
    ],
    "team": [
        {"name": "c1", "type": "carrier", "start": [1.5, 1.5]},
        {"name": "r1", "type": "rover", "carrier": "c1"},
    ],
    "goal": {"recover_rovers": True, "return_home": False},
    "limits": {"time_s": 900},
}  # fmt: skip

NOTHING = np.zeros((5, 12), dtype=bool)
GLASS = NOTHING.copy()
GLASS[2, 11] = True
WALL = NOTHING.copy()
WALL[3, 5] = True

PLAIN = Distortion(seed=1, hidden=NOTHING, flickers=NOTHING)
DISTORTIONS = {
    "glass": replace(PLAIN, hidden=GLASS),
    "open edges": replace(PLAIN, frame="hits", hidden=GLASS),
    "a wall that flickers": replace(PLAIN, flickers=WALL, wrong=0.5),
    "late and partial": replace(PLAIN, frame="known", late=3, shrinks=0.2),
    "a lattice that moves": replace(PLAIN, frame="known", shifts=0.1),
}


def run(folder: Path, distortion: Distortion, world: dict[str, Any] = WORLD) -> ReportedMission:
    (folder / "world.json").write_text(json.dumps(world))
    scenario = read_scenario(folder / "world.json")
    how = {"strategy": "heuristic", "planner": "greedy", "budget": Budget(steps=1), "seed": 1}
    return ReportingTeam(scenario, place_team(scenario, 1), distortion, how, None).run()


def found(mission: ReportedMission) -> str:
    return "\n".join(judge_reported(WORLD, mission))


@pytest.fixture(scope="module")
def glass(tmp_path_factory: pytest.TempPathFactory) -> ReportedMission:
    return run(tmp_path_factory.mktemp("storm"), DISTORTIONS["glass"])


@pytest.mark.parametrize("distortion", DISTORTIONS.values(), ids=DISTORTIONS)
def test_a_mission_with_a_map_of_its_own_breaks_no_rule(tmp_path: Path, distortion: Distortion) -> None:
    mission = run(tmp_path, distortion)
    assert found(mission) == ""


def edited(mission: ReportedMission, edit: Callable[[dict[str, Any]], dict[str, Any] | None]) -> ReportedMission:
    lines = (edit(json.loads(line)) for line in mission.lines)
    return replace(mission, lines=[json.dumps(line) for line in lines if line is not None])


def test_a_frontier_that_is_left_without_a_word_is_found(glass: ReportedMission) -> None:
    left = json.loads(glass.lines[-1])["remaining"]
    assert [one["cell"] for one in left] == [[10, 2]]
    silent = edited(glass, lambda line: line | {"remaining": []} if line["event"] == "ended" else line)
    assert "is complete, but robots can still reach (10, 2)" in found(silent)


def test_giving_up_what_robots_have_seen_is_found(glass: ReportedMission) -> None:
    late = replace(glass, known=drawn_cells(ROWS), distortion=PLAIN)
    assert "is given up, but robots have seen all cells there" in found(late)


def test_a_rover_that_is_left_behind_is_found(glass: ReportedMission) -> None:
    out = edited(glass, lambda line: line | {"aboard": []} if line["event"] == "ended" else line)
    assert "is complete, but ['r1 is not aboard']" in found(out)


def test_exploring_the_same_for_ever_is_found(glass: ReportedMission) -> None:
    ends = [i for i, line in enumerate(glass.lines) if '"end":"done"' in line and '"explore"' in line]
    begin = max(i for i in range(ends[-1]) if '"event":"start"' in glass.lines[i])
    again = glass.lines[begin : ends[-1] + 1]
    endless = replace(glass, lines=[*glass.lines[: ends[-1] + 1], *(20 * again), *glass.lines[ends[-1] + 1 :]])
    assert "times without any news" in found(endless)


def test_driving_through_a_wall_is_found(glass: ReportedMission) -> None:
    def astray(line: dict[str, Any]) -> dict[str, Any]:
        return line | {"steps": "66666"} if line["event"] == "drive" else line

    assert "is to drive to" in found(edited(glass, astray))


def test_a_map_is_late_by_some_reports_but_not_by_much_time() -> None:
    mapper, known = Mapper(replace(PLAIN, late=2)), np.full((5, 12), UNKNOWN, dtype=np.uint8)
    reported: list[int] = []
    for t_ms in (0, 1000, 2000, 2000 + MOST_LATE_MS + 1):
        known[0, len(reported)] = 0
        reported.append(int(np.count_nonzero(mapper.picture(known, t_ms, NOTHING).cells != UNKNOWN)))
    assert reported == [1, 1, 1, 4]


def test_a_loss_without_a_cause_is_found(glass: ReportedMission) -> None:
    lost = json.dumps({"event": "lost", "t_ms": 0, "robot": "r1", "reason": "stopped"})
    without = replace(glass, lines=[glass.lines[0], lost, *glass.lines[1:]])
    assert "r1 is lost, though nothing went wrong: stopped" in found(without)


def test_a_log_without_a_report_of_the_map_is_found(glass: ReportedMission) -> None:
    reveals = [i for i, line in enumerate(glass.lines) if '"event":"reveal"' in line]
    deaf = replace(glass, lines=[line for i, line in enumerate(glass.lines) if i != reveals[-1]])
    assert re.search(r"the map has 255 at .*, but \d was reported", found(deaf))


def test_a_cell_that_is_revealed_again_is_found(glass: ReportedMission) -> None:
    reveal = next(i for i, line in enumerate(glass.lines) if '"event":"reveal"' in line)
    again = replace(glass, lines=[*glass.lines[: reveal + 1], *glass.lines[reveal:]])
    assert re.search(r"c1 sees (\d) at .*, which was \1", found(again))


def test_metres_that_nobody_drove_are_found(glass: ReportedMission) -> None:
    far = edited(
        glass, lambda line: line | {"distance_m": [["c1", 999.0], ["r1", 0.0]]} if "distance_m" in line else line
    )
    assert "c1 drove 999.0 m, in truth" in found(far)
