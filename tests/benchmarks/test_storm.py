import json
import random
from collections import Counter
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

import marsupial
from benchmarks.storm.additions import draw_seats
from benchmarks.storm.oracle import ALWAYS, SIMULATED, OracleRule, judge_simulated
from benchmarks.storm.rules import (
    batteries,
    contact,
    coverage,
    docking,
    failures,
    lines,
    losses,
    motion,
    plans,
    remaining,
    sensing,
    status,
    totals,
    zones,
)
from benchmarks.storm.runs import LEADS_CARRIERS, LEADS_ROVERS
from benchmarks.storm.worlds import scenario
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


def judged(lines: Lines, summary: dict[str, Any], world: dict[str, Any] = WORLD) -> str:
    return "\n".join(judge_simulated(world, [json.dumps(line) for line in lines], summary))


def test_a_mission_as_it_was_breaks_no_rule(mission: tuple[Lines, dict[str, Any]]) -> None:
    assert judged(*mission) == ""


def first(lines: Lines, event: str) -> dict[str, Any]:
    return next(line for line in lines if line["event"] == event)


def lead_elsewhere(world: dict[str, Any], lines: Lines) -> None:
    """Let only the upper part of the room count; one of the plan's two targets leads there."""
    zone = {"kind": "explore", "polygon_m": [[6, 3], [9, 3], [9, 5], [6, 5]]}
    world["zones"] = [{"name": "z"} | zone]
    lines.insert(1, {"event": "zone", "t_ms": 0, "name": "z", "zone": zone | {"weight": 1}})


def drain(world: dict[str, Any], lines: Lines) -> None:
    lines[0]["types"][0]["battery"] = {"capacity_j": 100, "charge_w": 0}
    first(lines, "plan")["charges"] = [["c1", 0.5]]


def wall_up(world: dict[str, Any], lines: Lines) -> None:
    world["map"]["rows"][2] = world["map"]["rows"][1]


PLANTED: dict[OracleRule, tuple[Callable[[dict[str, Any], Lines], Any], str]] = {
    lines.lines_are_in_order: (lambda _, log: log[-1].update(t_ms=0), "time goes back"),
    plans.plans_are_valid: (lambda _, log: first(log, "plan").update(revision=7), "plan 1 is called 7"),
    docking.actions_begin_rightly: (
        lambda _, log: next(line for line in log if line.get("cell") == [5, 2]).update(cell=[8, 1]),
        "r1 at (8, 1) and c1 at (4, 2) are too far apart",
    ),
    docking.rovers_have_places: (lambda _, log: log[0]["types"][0].update(capacity=0), "c1 carries ['rover']"),
    docking.actions_end_rightly: (
        lambda _, log: log[0]["types"][1].update(dock_ms=10001),
        "r1 took 10000 ms to dock, not 10001",
    ),
    motion.drives_begin_rightly: (
        lambda _, log: first(log, "drive").update(cell=[3, 3]),
        "c1 sets out from (3, 3), but stands at (1, 1)",
    ),
    motion.drives_are_true: (
        lambda _, log: first(log, "drive").update(steps="6"),
        "c1 can't step from (1, 1) to (1, 0)",
    ),
    motion.robots_stand_where_they_fit: (
        lambda _, log: log[0]["types"][0].update(radius_m=1.5),
        "c1 stands at (1, 1), where its footprint does not fit",
    ),
    zones.zones_hold: (
        lambda world, _: world.update(zones=[{"name": "z", "kind": "no_go", "polygon_m": [[1, 1], [2, 1], [2, 2]]}]),
        "the zone z never began",
    ),
    zones.targets_lead_into_the_area: (lead_elsewhere, "target t_7_1 leads out of the area to explore"),
    totals.counts_are_those_of_the_log: (lambda _, log: log[-1].update(aboard=[]), "aboard are [], by the log ['r1']"),
    totals.metres_and_energy_are_true: (lambda _, log: log[-1]["distance_m"][0].__setitem__(1, 9.0), "c1 drove 9.0 m"),
    status.status_is_true: (lambda _, log: log[-1].update(status="time_limit"), "the time limit is 600000 ms"),
    batteries.charges_are_true: (drain, "c1 has a charge of 0.5, not 1.0000"),
    contact.contact_is_by_range: (
        lambda _, log: log.insert(-1, {"event": "away", "t_ms": 38312, "robot": "r1"}),
        "r1 can't lose contact",
    ),
    failures.failures_have_causes: (
        lambda _, log: first(log, "end").update(end="failed"),
        "explore of c1 failed, though no fault was asked for",
    ),
    losses.losses_have_causes: (
        lambda _, log: log.insert(-1, {"event": "lost", "t_ms": 38312, "robot": "r1", "reason": "stopped"}),
        "r1 is lost, though no fault was asked for",
    ),
    sensing.what_is_seen_is_true: (wall_up, "c1 sees 2 at (5, 2), where 0 is"),
    sensing.what_is_seen_is_in_range: (
        lambda _, log: log[0]["types"][0].update(sensor_range_m=1),
        "out of its range of 1.81 cells",
    ),
    sensing.what_is_in_plain_view_is_seen: (
        lambda _, log: log.remove(first(log, "reveal")),
        "c1 was at (1, 1) and did not see",
    ),
    coverage.areas_are_those_of_the_map: (
        lambda _, log: log[-1].update(explored_area_m2=21.0, reachable_area_m2=21.0),
        "explored and reachable area are (21.0, 21.0)",
    ),
    coverage.all_that_is_reachable_is_known: (
        lambda _, log: log[-1].update(explored_area_m2=20.0),
        "is complete at 90.9% coverage",
    ),
    remaining.remaining_frontiers_are_frontiers: (
        lambda _, log: log[-1].update(remaining=[{"cell": [3, 2], "reason": "no way there"}]),
        "(3, 2) is called a frontier that is left, but is none",
    ),
}
"""For each rule a change of the log or the scenario that breaks it, and what it then finds."""


@pytest.mark.parametrize("rule", [*ALWAYS, *SIMULATED], ids=lambda rule: rule.__name__)
def test_each_rule_finds_what_breaks_it(mission: tuple[Lines, dict[str, Any]], rule: OracleRule) -> None:
    edit, sentence = PLANTED[rule]
    world, (log, summary) = deepcopy(WORLD), deepcopy(mission)
    edit(world, log)
    assert sentence in judged(log, summary, world)


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
    assert judge_simulated(world, lines, summary) == []
    assert judge_simulated(HALL, lines, summary) != []


def test_robots_that_do_not_hear_of_a_zone_are_found(tmp_path: Path) -> None:
    zone = {"name": "z", "kind": "no_go", "polygon_m": [[12, 0], [16, 0], [16, 9], [12, 9]], "from_s": 2.0}
    runs = []
    for number, world in enumerate((HALL, HALL | {"zones": [zone]})):
        file, log = tmp_path / f"{number}.json", tmp_path / f"{number}.jsonl"
        file.write_text(json.dumps(world))
        summary = marsupial.explore(file, "heuristic", log=log).as_dict()
        runs.append((log.read_text().splitlines(), summary))
    (deaf, deaf_summary), (lines, summary) = runs
    assert judge_simulated(world, lines, summary) == []
    begins = next(line for line in lines if '"event":"zone"' in line)
    late = next(i for i, line in enumerate(deaf) if json.loads(line)["t_ms"] > 2000)
    found = "\n".join(judge_simulated(world, [*deaf[:late], begins, *deaf[late:]], deaf_summary))
    assert "c1 enters z at" in found
    assert "c1 is to drive to" in found
    assert "explored and reachable area are" in found
    assert "the zone z never began" in "\n".join(judge_simulated(world, deaf, deaf_summary))


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
    assert judge_simulated(world, lines, summary) == []
    one_type = [line.replace('"type":"large"', '"type":"rover"') for line in lines]
    assert any("c1 carries ['rover', 'rover']" in found for found in judge_simulated(world, one_type, summary))
    types[0] = types[0] | {"seats": {"rover": 1}}
    found = judge_simulated(world, lines, summary)
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
