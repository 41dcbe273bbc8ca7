from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from synthetic_mission import mission_started, synthetic_mission

from marsupial.errors import LogError
from marsupial.formats.missionlog import EVENTS, LogWriter, encode_event, parse_log, read_log
from marsupial.formats.triggers import read_triggers
from marsupial.model.grid import Cell, Terrain
from marsupial.model.mission import (
    ActionEnd,
    ActionEnded,
    ActionStarted,
    DriveEnded,
    DriveStarted,
    MapMeeting,
    MapTarget,
    MissionEnded,
    MissionEvent,
    PlacedRobot,
    Planned,
    Remaining,
    Revealed,
    RobotLost,
    Status,
)
from marsupial.model.plan import Action, ActionName
from marsupial.model.robots import EnergyModel, RobotType, Role
from marsupial.model.scenario import Goal

START = mission_started()


def text_of(*events: MissionEvent) -> bytes:
    return "".join(encode_event(event) + "\n" for event in events).encode("ascii")


def read_changed(event: MissionEvent, change: Callable[[dict[str, Any]], object]) -> str:
    """Return what is said of a log whose only event after the first was changed as JSON."""
    value = json.loads(encode_event(event))
    change(value)
    with pytest.raises(LogError) as caught:
        parse_log(text_of(START) + json.dumps(value).encode("ascii") + b"\n", source="m.jsonl")
    return str(caught.value)


# What comes out is what went in.


def test_a_whole_mission_comes_back_as_it_was(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "m.jsonl") as writer:
        for event in synthetic_mission():
            writer.write(event)
    log = read_log(tmp_path / "m.jsonl")
    assert log.events == synthetic_mission()
    assert not log.truncated
    assert log.mission == START
    assert log.ended == synthetic_mission()[-1]


cells = st.builds(Cell, st.integers(0, START.width - 1), st.integers(0, START.height - 1))
times = st.integers(0, 2**53)
numbers = st.floats(allow_nan=False, allow_infinity=False)
names = st.text(max_size=8)
robots = st.sampled_from([robot.name for robot in START.robots])
rovers = st.sampled_from(["rover1_1", "rover1_2"])
driving = st.sampled_from([ActionName.MOVE, ActionName.EXPLORE])
docking = st.sampled_from([ActionName.DOCK, ActionName.UNDOCK])
action_times = {"start_ms": times, "duration_ms": times, "place": names}
actions = st.one_of(
    st.builds(Action, name=driving, robot=robots, origin=names, carrier=st.none(), **action_times),
    st.builds(Action, name=docking, robot=rovers, origin=st.none(), carrier=st.just("carrier1"), **action_times),
)
targets = st.builds(
    MapTarget,
    name=names,
    cell=cells,
    explorers=st.lists(names, max_size=2).map(tuple),
    reveal_m2=numbers,
    frontier_cells=times,
)
meetings = st.builds(MapMeeting, name=names, carrier_cell=cells, rover_cell=cells, carrier_type=names, rover_type=names)
runs = st.tuples(st.integers(0, 60 * 39), st.integers(1, 60), st.integers(0, 254))
pairs = st.lists(st.tuples(names, numbers), max_size=3).map(tuple)
types = st.builds(
    RobotType,
    name=st.just("carrier"),
    role=st.just(Role.CARRIER),
    speed_mps=st.floats(min_value=0.01, max_value=100),
    sensor_range_m=numbers,
    radius_m=numbers,
    terrains=st.frozensets(st.integers(0, 254), max_size=5),
    capacity=times,
    dock_ms=times,
    undock_ms=times,
    energy=st.builds(
        EnergyModel,
        idle_w=numbers,
        drive_w=numbers,
        metre_j=numbers,
        stop_j=numbers,
        turn_j=st.tuples(numbers, numbers, numbers, numbers),
    ),
)
starts = st.builds(
    lambda kind, terrains, goal, resolution_m, origin_m, name: replace(
        START,
        scenario=name,
        types=(kind,),
        terrains=terrains,
        goal=goal,
        resolution_m=resolution_m,
        origin_m=origin_m,
        robots=(PlacedRobot(name="carrier1", type="carrier", cell=Cell(0, 0)),),
    ),
    types,
    st.lists(st.builds(Terrain, code=st.integers(0, 254), name=names, blocks_sight=st.booleans())).map(tuple),
    st.builds(Goal, recover_rovers=st.booleans(), return_home=st.booleans()),
    st.floats(min_value=1e-3, max_value=1e3),
    st.tuples(numbers, numbers, numbers),
    names,
)
later_events = st.one_of(
    st.builds(
        Revealed,
        t_ms=times,
        robot=robots,
        runs=st.lists(runs, max_size=6).map(lambda many: tuple(number for run in many for number in run)),
    ),
    st.builds(
        DriveStarted, t_ms=times, robot=robots, cell=st.just(Cell(30, 20)), steps=st.text("01234567", max_size=15)
    ),
    st.builds(DriveEnded, t_ms=times, robot=robots, cell=cells),
    st.builds(
        Planned,
        t_ms=times,
        revision=times,
        trigger=names.map(read_triggers),
        targets=st.lists(targets, max_size=2).map(tuple),
        meetings=st.lists(meetings, max_size=2).map(tuple),
        actions=st.lists(actions, max_size=2).map(tuple),
    ),
    st.builds(ActionStarted, t_ms=times, revision=times, action=actions, cell=cells),
    st.builds(ActionEnded, t_ms=times, revision=times, action=actions, end=st.sampled_from(ActionEnd)),
    st.builds(RobotLost, t_ms=times, robot=robots, reason=names),
    st.builds(
        MissionEnded,
        t_ms=times,
        status=st.sampled_from(Status),
        reason=names,
        exploration_ms=st.none() | times,
        explored_area_m2=numbers,
        reachable_area_m2=numbers,
        distance_m=pairs,
        energy_j=pairs,
        deployments=times,
        retrievals=times,
        replans=times,
        plans_valid=times,
        plans_invalid=times,
        aboard=st.lists(names, max_size=3).map(tuple),
        remaining=st.lists(st.builds(Remaining, cell=cells, frontier_cells=times, reason=names), max_size=3).map(tuple),
    ),
)


@settings(max_examples=300, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(later_events)
def test_every_event_comes_back_exactly(event: MissionEvent) -> None:
    events = parse_log(text_of(START, event)).events
    assert events == (START, event)
    assert text_of(*events) == text_of(START, event)


@settings(max_examples=100, deadline=None)
@given(starts)
def test_every_mission_comes_back_exactly(event: MissionEvent) -> None:
    assert parse_log(text_of(event)).events == (event,)


def test_every_class_of_event_has_a_tag() -> None:
    assert set(EVENTS.values()) == set(MissionEvent.__args__)


def test_no_event_has_a_field_that_the_format_uses_itself() -> None:
    assert not {"event", "format", "version"} & {field.name for kind in EVENTS.values() for field in fields(kind)}


# Writing.


def test_the_first_line_says_format_and_version() -> None:
    assert encode_event(START).startswith('{"event":"mission","format":"marsupial-log","version":1,"t_ms":0,')


def test_a_line_has_its_fields_in_the_order_of_the_class_and_no_spaces() -> None:
    event = DriveStarted(t_ms=5, robot="rover1_1", cell=Cell(3, 4), steps="017")
    assert encode_event(event) == '{"event":"drive","t_ms":5,"robot":"rover1_1","cell":[3,4],"steps":"017"}'


def test_sets_are_written_in_order() -> None:
    kind = replace(START.types[0], terrains=frozenset({17, 3, 200, 1}))
    assert '"terrains":[1,3,17,200]' in encode_event(replace(START, types=(kind,)))


def test_numpy_integers_are_written_as_numbers() -> None:
    event = Revealed(t_ms=0, robot="carrier1", runs=tuple(np.array([7, 2, 1])))
    assert encode_event(event) == '{"event":"reveal","t_ms":0,"robot":"carrier1","runs":[7,2,1]}'


def test_what_is_no_number_is_not_written() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        encode_event(replace(START, resolution_m=float("nan")))


def test_every_event_is_on_disk_as_soon_as_it_is_written(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "m.jsonl") as writer:
        writer.write(START)
        assert read_log(tmp_path / "m.jsonl").events == (START,)


def test_a_stream_is_written_to_and_left_open() -> None:
    stream = io.StringIO()
    with LogWriter(stream) as writer:
        writer.write(START)
    assert stream.getvalue() == encode_event(START) + "\n"


def test_a_writer_outside_its_block_refuses_to_write() -> None:
    with pytest.raises(ValueError, match="inside its with block"):
        LogWriter(io.StringIO()).write(START)


# A run that was killed.


def test_a_line_cut_off_at_the_end_is_left_out_and_reported() -> None:
    whole = text_of(*synthetic_mission())
    log = parse_log(whole[:-9])
    assert log.truncated
    assert log.events == synthetic_mission()[:-1]
    assert log.ended is None


def test_a_last_line_that_only_lacks_its_line_break_is_whole() -> None:
    log = parse_log(text_of(*synthetic_mission())[:-1])
    assert log.events == synthetic_mission()
    assert not log.truncated


def test_a_log_cut_off_in_its_first_line_holds_no_mission() -> None:
    with pytest.raises(LogError, match="holds no mission"):
        parse_log(text_of(START)[:40])


def test_a_broken_line_in_the_middle_is_an_error() -> None:
    with pytest.raises(LogError, match="line 2: is not JSON"):
        parse_log(text_of(START) + b'{"event":"stand","t_m\n' + text_of(START))


# Files that are no logs.


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"gone\.jsonl: can't be read: No such file"):
        read_log(tmp_path / "gone.jsonl")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "holds no mission"),
        (b"\x89PNG\r\n\x1a\n", "line 1: is not JSON"),
        (b"[1,2]\n", r"line 1: must be a JSON object, got \[1, 2\]"),
        (b"{}\n", "line 1: event: must be one of mission, reveal, .*, got null"),
        (b"[" * 100_000 + b"\n", "line 1: is not JSON"),
        (b'{"event":"mission"}\n', 'line 1: format: must be "marsupial-log", got null'),
        (b'{"event":"mission","format":"marsupial-log","version":2}\n', "line 1: version: must be 1, .*, got 2"),
    ],
)
def test_a_file_that_is_no_log_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(LogError, match=message):
        parse_log(data)


def test_the_first_event_must_be_the_mission() -> None:
    with pytest.raises(LogError, match="line 1: event: the first event must be the mission"):
        parse_log(text_of(*synthetic_mission()[1:]))


# Wrong fields, each named by line and path.

DRIVE = DriveStarted(t_ms=5, robot="rover1_1", cell=Cell(3, 4), steps="017")
MOVE = Action(name=ActionName.MOVE, start_ms=0, duration_ms=5, robot="carrier1", place="m1", origin="s")
BEGIN = ActionStarted(t_ms=5, revision=1, action=MOVE, cell=Cell(3, 4))
SEEN = Revealed(t_ms=5, robot="rover1_1", runs=(7, 2, 1))


@pytest.mark.parametrize(
    ("event", "path", "value", "message"),
    [
        (DRIVE, "event", "fly", 'event: must be one of mission, reveal, drive, .*, got "fly"'),
        (DRIVE, "t_ms", 5.0, r"t_ms: must be a whole number, got 5\.0"),
        (DRIVE, "t_ms", True, "t_ms: must be a whole number, got true"),
        (DRIVE, "t_ms", -1, "t_ms: must not go back, got -1 after 0"),
        (DRIVE, "robot", 7, "robot: must be a string, got 7"),
        (DRIVE, "robot", "rover9", "robot: no such robot: 'rover9'"),
        (DRIVE, "cell", [3], r"cell: must be an array of 2, got \[3\]"),
        (DRIVE, "cell", [3, 40], r"cell: lies outside the map: \[3, 40\]"),
        (DRIVE, "steps", "018", "steps: must be digits from 0 to 7, got '018'"),
        (DRIVE, "steps", "44440", "steps: leave the map"),
        (DRIVE, "speed", 1, "speed: is not a field of this event"),
        (SEEN, "runs", [7, 2], r"runs: must be \(start, length, code\) three by three"),
        (SEEN, "runs", [2399, 2, 1], "runs: must be .*, inside the map"),
        (SEEN, "runs", [7, 0, 1], "runs: must be"),
        (SEEN, "runs", [7, 2, 255], "runs: must be .* codes 0 to 254"),
        (SEEN, "runs", [10**30, 2, 1], "runs: must be"),
        (SEEN, "runs", [7, 2, "x"], r'runs\[2\]: must be a whole number, got "x"'),
        (BEGIN, "action.name", "fly", 'action.name: must be one of move, explore, dock, undock, got "fly"'),
        (BEGIN, "action.name", "dock", "action.robot: a carrier can't be carried"),
        (BEGIN, "action.carrier", "carrier1", "action.carrier: a move has none, got 'carrier1'"),
        (BEGIN, "action.duration_ms", -5, "action.duration_ms: must be 0 or more, got -5"),
        (BEGIN, "action", [], r"action: must be an object, got \[\]"),
        (BEGIN, "cell", [60, 0], r"cell: lies outside the map: \[60, 0\]"),
    ],
)
def test_a_wrong_field_is_named_by_line_and_path(event: MissionEvent, path: str, value: Any, message: str) -> None:
    def change(line: dict[str, Any]) -> None:
        *outer, last = path.split(".")
        for name in outer:
            line = line[name]
        line[last] = value

    said = read_changed(event, change)
    assert said.startswith("m.jsonl: line 2: ")
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(said)


def test_a_missing_field_is_named() -> None:
    assert "m.jsonl: line 2: steps: is missing" in read_changed(DRIVE, lambda line: line.pop("steps"))


def test_a_field_with_a_default_may_be_missing() -> None:
    value = json.loads(encode_event(START))
    for terrain in value["terrains"]:
        del terrain["blocks_sight"]
    terrains = parse_log(json.dumps(value).encode("ascii")).mission.terrains
    assert [terrain.blocks_sight for terrain in terrains] == [False, False, False]


def test_a_whole_number_is_fine_where_a_number_is_wanted() -> None:
    value = json.loads(encode_event(START)) | {"resolution_m": 1}
    assert parse_log(json.dumps(value).encode("ascii")).mission.resolution_m == 1.0


def test_words_that_are_no_numbers_are_refused() -> None:
    line = encode_event(START).replace('"resolution_m":0.25', '"resolution_m":NaN')
    with pytest.raises(LogError, match="line 1: is not JSON: NaN is not a number"):
        parse_log(line.encode("ascii") + b"\n")


def test_all_wrong_fields_are_reported_at_once() -> None:
    bad = encode_event(DRIVE).replace("rover1_1", "rover9").replace("017", "x").encode("ascii")
    with pytest.raises(LogError) as caught:
        parse_log(text_of(START) + bad + b"\n" + bad + b"\n")
    assert [problem.path for problem in caught.value.problems] == [
        "line 2: robot",
        "line 2: steps",
        "line 3: robot",
        "line 3: steps",
    ]


def test_a_file_full_of_problems_reports_the_first_fifty() -> None:
    with pytest.raises(LogError) as caught:
        parse_log(text_of(START) + b"{}\n" * 1000)
    assert len(caught.value.problems) == 50


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 0}, "width: a map needs at least one cell, got 0 x 40"),
        ({"resolution_m": 0.0}, r"resolution_m: must be positive, got 0\.0"),
        ({"types": (replace(START.types[0], speed_mps=0.0),)}, r"types\[0\]\.speed_mps: must be positive"),
        ({"robots": (START.robots[0], START.robots[0])}, "robots: two robots have the same name"),
        ({"robots": (replace(START.robots[0], type="boat"),)}, r"robots\[0\]\.type: no such robot type: 'boat'"),
        ({"robots": (replace(START.robots[0], cell=None),)}, r"robots\[0\]: must have either a cell or a carrier"),
        ({"robots": (replace(START.robots[0], cell=Cell(60, 0)),)}, r"robots\[0\]\.cell: lies outside the map"),
        ({"robots": START.robots[1:]}, r"robots\[0\]\.carrier: no such carrier: 'carrier1'"),
    ],
)
def test_a_mission_that_makes_no_sense_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(LogError, match=f"line 1: {message}"):
        parse_log(text_of(replace(START, **change)))


def test_nothing_may_follow_the_end() -> None:
    late = DriveEnded(t_ms=26_005, robot="carrier1", cell=Cell(1, 1))
    with pytest.raises(LogError, match="line 50: event: nothing may follow the end of the mission"):
        parse_log(text_of(*synthetic_mission(), late))


def test_a_log_holds_one_mission() -> None:
    with pytest.raises(LogError, match="line 2: event: a log holds one mission"):
        parse_log(text_of(START, START))
