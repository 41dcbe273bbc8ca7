import json
import random
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

import marsupial
from benchmarks.storm.oracle import Oracle
from benchmarks.storm.runs import LEADS_CARRIERS, LEADS_ROVERS
from benchmarks.storm.worlds import draw_seats, scenario
from marsupial.strategies.registry import strategy_names

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

HALL = WORLD | {
    "map": {
        "resolution_m": 1.0,
        "rows": [43 * "#", *6 * [f"#{30 * '.'}#{10 * '~'}#"], *2 * [f"#{31 * '.'}{10 * '~'}#"], 43 * "#"],
    }
}
"""A long hall before a room with a door; some known cells are far from all robots."""

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


def test_a_mission_as_it_was_breaks_no_rule(mission: tuple[Lines, dict[str, Any]]) -> None:
    assert judged(*mission) == ""


def test_a_robot_that_jumps_and_a_rover_left_behind_are_found(mission: tuple[Lines, dict[str, Any]]) -> None:
    lines, summary = json.loads(json.dumps(mission))
    next(line for line in lines if line["event"] == "drive")["cell"] = [3, 3]
    lines[-1]["aboard"] = []
    found = judged(lines, summary)
    assert "sets out from (3, 3), but stands at" in found
    assert "aboard are [], by the log ['r1']" in found


@pytest.mark.parametrize(
    ("fault", "event"),
    [
        ({"fault": "lost", "robot": "r1", "at_s": 20}, {"event": "lost"}),
        ({"fault": "docking_fails", "robot": "r1", "at_s": 0}, {"event": "end", "end": "failed"}),
        ({"fault": "slows", "robot": "c1", "at_s": 2, "speed_share": 0.5}, {"event": "speed", "share": 0.5}),
        ({"fault": "ground", "area_m": [3.5, 7.5, 3.5, 7.5], "terrain": "obstacle", "at_s": 5}, {"event": "change"}),
    ],
)
def test_a_mission_with_a_fault_breaks_only_the_rule_against_faults(
    tmp_path: Path, fault: dict[str, Any], event: dict[str, Any]
) -> None:
    log, world = tmp_path / "log.jsonl", HALL | {"faults": [fault]}
    (tmp_path / "world.json").write_text(json.dumps(world))
    summary = marsupial.explore(tmp_path / "world.json", "heuristic", log=log).as_dict()
    lines = log.read_text().splitlines()
    assert any(event.items() <= json.loads(line).items() for line in lines)
    assert Oracle(world, lines, summary).judge() == []
    assert Oracle(HALL, lines, summary).judge() != []


def test_robots_that_do_not_hear_of_a_zone_are_found(tmp_path: Path) -> None:
    zone = {"name": "z", "kind": "no_go", "polygon_m": [[12, 0], [16, 0], [16, 9], [12, 9]], "from_s": 2.0}
    runs = []
    for number, world in enumerate((HALL, HALL | {"zones": [zone]})):
        file, log = tmp_path / f"{number}.json", tmp_path / f"{number}.jsonl"
        file.write_text(json.dumps(world))
        summary = marsupial.explore(file, "heuristic", log=log).as_dict()
        runs.append((log.read_text().splitlines(), summary))
    (deaf, deaf_summary), (lines, summary) = runs
    assert Oracle(world, lines, summary).judge() == []
    told = next(line for line in lines if '"event":"zone"' in line)
    late = next(i for i, line in enumerate(deaf) if json.loads(line)["t_ms"] > 2000)
    found = "\n".join(Oracle(world, [*deaf[:late], told, *deaf[late:]], deaf_summary).judge())
    assert "c1 enters z at" in found
    assert "c1 is to drive to" in found
    assert "explored and reachable area are" in found
    assert "the zone z never began" in "\n".join(Oracle(world, deaf, deaf_summary).judge())


def test_every_strategy_is_drawn() -> None:
    assert {*LEADS_CARRIERS, *LEADS_ROVERS} == {*strategy_names(), "clairvoyant"}


def test_rovers_without_a_seat_are_found_by_their_type(tmp_path: Path) -> None:
    carrier, rover = WORLD["robot_types"]
    types = [carrier | {"capacity": 2, "seats": {"rover": 1, "large": 1}}, rover, rover | {"name": "large"}]
    team = [*WORLD["team"], {"name": "k1", "type": "large", "carrier": "c1"}]
    world, log = WORLD | {"robot_types": types, "team": team}, tmp_path / "log.jsonl"
    (tmp_path / "world.json").write_text(json.dumps(world))
    summary = marsupial.explore(tmp_path / "world.json", "heuristic", log=log).as_dict()
    lines = log.read_text().splitlines()
    assert Oracle(world, lines, summary).judge() == []
    one_type = [line.replace('"type":"large"', '"type":"rover"') for line in lines]
    assert any("c1 carries ['rover', 'rover']" in found for found in Oracle(world, one_type, summary).judge())
    types[0] = types[0] | {"seats": {"rover": 1}}
    found = Oracle(world, lines, summary).judge()
    assert any("the seats of carrier are" in one for one in found)


@pytest.mark.parametrize("number", range(30))
def test_drawn_teams_with_seats_have_places_for_all_aboard(number: int) -> None:
    rng = random.Random(number)
    _, document = scenario(rng, rovers=True)
    draw_seats(rng, document)
    kinds = {kind["name"]: kind for kind in document["robot_types"]}
    for robot in document["team"]:
        aboard = Counter(one["type"] for one in document["team"] if one.get("carrier") == robot["name"])
        kind = kinds[robot["type"]]
        seats = kind.get("seats", aboard)
        assert aboard.total() <= kind.get("capacity", 0)
        assert all(count <= seats.get(name, 0) for name, count in aboard.items())
