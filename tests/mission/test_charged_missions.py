"""Missions whose robots have batteries: nobody is stranded, and nothing changes where batteries never bind."""

from pathlib import Path

import pytest
from support.missions.faulty_mission import YARD

from benchmarks.studies.batteries import with_batteries
from marsupial.formats.loglines import log_lines
from marsupial.formats.missionlog import parse_log
from marsupial.formats.scenario import read_scenario
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.library.recording import Recorder
from marsupial.mission.rebuild import moment_at
from marsupial.model import ActionName, Battery, Budget, MissionEnded, Scenario
from marsupial.model.mission import ActionStarted, MissionEvent, MissionStarted, Planned, RobotLost


def flown(scenario: Scenario, strategy: str = "heuristic") -> list[MissionEvent]:
    recorder = Recorder()
    simulate(scenario, strategy=strategy, planner="greedy", budget=Budget(steps=1), seed=1, observer=recorder)
    return recorder.events


def ended(events: list[MissionEvent]) -> MissionEnded:
    assert isinstance(events[-1], MissionEnded)
    return events[-1]


def actions(events: list[MissionEvent]) -> list[tuple[int, str]]:
    return [(event.t_ms, str(event.action)) for event in events if isinstance(event, ActionStarted)]


OFFICE, ROOMS = (builtin_scenario(name, 2, 2) for name in ("office", "rooms"))


@pytest.mark.parametrize(
    ("strategy", "scenario", "rover_j", "carrier_j"),
    [
        ("heuristic", OFFICE, 800.0, None),
        ("heuristic", OFFICE, 1500.0, 30_000.0),
        ("assignment", OFFICE, 800.0, None),
        ("assignment", OFFICE, 1500.0, 30_000.0),
        ("temporal", ROOMS, 800.0, None),
    ],
)
def test_small_batteries_strand_nobody(
    strategy: str, scenario: Scenario, rover_j: float, carrier_j: float | None
) -> None:
    events = flown(with_batteries(scenario, 1, rover_j, carrier_j), strategy)
    assert not [event for event in events if isinstance(event, RobotLost)]
    end = ended(events)
    assert end.status == "complete" or end.reason.startswith("no battery suffices for t_")
    plans = [event for event in events if isinstance(event, Planned)]
    levels = [share for plan in plans for _, share in plan.charges]
    assert 0 < min(levels) < 0.6


def test_batteries_that_never_bind_change_nothing() -> None:
    free, large = flown(OFFICE), flown(with_batteries(OFFICE, 1, 1e9, 1e9))
    assert actions(free) == actions(large)


def test_a_mission_stops_where_no_battery_suffices_with_its_rovers_aboard() -> None:
    events = flown(with_batteries(OFFICE, 1, 300.0, None))
    end = ended(events)
    assert end.status == "stalled"
    assert end.reason.startswith("no battery suffices for t_")
    assert len(end.aboard) == 4


def test_carriers_return_to_the_charging_place() -> None:
    events = flown(with_batteries(OFFICE, 1, None, 20_000.0), "temporal")
    drives = [event.action for event in events if isinstance(event, ActionStarted)]
    assert [action for action in drives if action.name is ActionName.MOVE and action.place.startswith("charge_")]
    assert ended(events).status == "complete"


def test_a_log_has_charges_and_charging_places() -> None:
    events = flown(with_batteries(OFFICE, 1, 1500.0, 30_000.0))
    read = parse_log("\n".join(log_lines(events)).encode()).events
    assert [event for event in read if isinstance(event, Planned)] == [e for e in events if isinstance(e, Planned)]
    started = next(event for event in read if isinstance(event, MissionStarted))
    assert len(started.chargers) == 1
    assert {kind.battery.capacity_j for kind in started.types if kind.battery} == {1500.0, 30_000.0}
    middle = moment_at(read, ended(events).t_ms // 2)
    assert {robot.charge is None for robot in middle.robots} == {False}


SCENARIO = """\
format: marsupial-scenario
version: 1
map: {rows: ["#######", "#.....#", "#.....#", "#######"], resolution_m: 1.0}
robot_types:
  - {name: truck, role: carrier, speed_mps: 1, sensor_range_m: 5, radius_m: 0, terrains: [floor], capacity: 1,
     battery: {capacity_j: 5000, charge_w: 100}}
  - {name: scout, role: rover, speed_mps: 1, sensor_range_m: 5, radius_m: 0, terrains: [floor], dock_s: 1, undock_s: 1,
     battery: {capacity_j: BATTERY}, energy: {idle_w: 1, stop_j: STOP}}
chargers: [{at_m: AT}]
team: {carriers: 1, rovers_per_carrier: 1}
"""


def written(folder: Path, battery: str = "100", stop: str = "0", at: str = "[1.5, 1.5]") -> Path:
    path = folder / "small.yaml"
    text = SCENARIO.replace("BATTERY", battery).replace("STOP", stop).replace("AT", at)
    path.write_text(text, encoding="utf-8")
    return path


def test_scenario_files_have_batteries_and_charging_places(tmp_path: Path) -> None:
    scenario = read_scenario(written(tmp_path))
    truck, scout = scenario.robot_types
    assert truck.battery == Battery(capacity_j=5000.0, charge_w=100.0)
    assert scout.battery == Battery(capacity_j=100.0)
    assert scenario.grid.chargers == ((1, 1),)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"battery": "0"}, "robot_types[1].battery.capacity_j: must be positive, got 0"),
        ({"stop": "1"}, "robot_types[1].battery: plans know no energy of stops and turns"),
        ({"at": "[0.5, 0.5]"}, "chargers[0].at_m: is an obstacle"),
        ({"at": "[9.5, 0.5]"}, "chargers[0].at_m: [9.5, 0.5] is outside the map"),
    ],
)
def test_wrong_batteries_and_charging_places_are_refused(tmp_path: Path, wrong: dict[str, str], problem: str) -> None:
    with pytest.raises(Exception, match=r"small.yaml") as error:
        read_scenario(written(tmp_path, **wrong))
    assert problem in str(error.value)


def test_a_rover_without_a_seat_explores_and_waits_at_a_charging_place(tmp_path: Path) -> None:
    text = YARD.split("team:")[0].replace("capacity: 2", "capacity: 1")
    text = text.replace(
        "undock_s: 5", "undock_s: 5, energy: {idle_w: 4, drive_w: 8}, battery: {capacity_j: 250, charge_w: 60}"
    )
    text += "team:\n  - {name: c1, type: carrier, start: [1.75, 1.25]}\n  - {name: r1, type: rover, carrier: c1}\n"
    text += "  - {name: r2, type: rover, start: [2.25, 2.75]}\nchargers: [{at_m: [2.25, 2.75]}]\n"
    (tmp_path / "yard.yaml").write_text(text)
    events = flown(read_scenario(tmp_path / "yard.yaml"))
    end = ended(events)
    assert end.reason.startswith("no place aboard for r1")  # which can't be helped, once everything is explored
    assert not end.remaining
    drives = [event.action for event in events if isinstance(event, ActionStarted)]
    assert {action.robot for action in drives if action.place.startswith("charge_")} == {"r1", "r2"}
