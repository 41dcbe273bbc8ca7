"""The lines of a mission log: written, read back, and refused where they are wrong."""

import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_events import START, later_events, painted, starts
from hypothesis import given, settings
from support.missions.synthetic_mission import synthetic_mission

from marsupial.errors import LogError
from marsupial.formats.loglines import EVENTS, LogEncoder, log_lines, read_triggers, trigger_text
from marsupial.formats.missionlog import parse_log, read_log
from marsupial.library.recording import LogFile
from marsupial.mission.playback import Playback
from marsupial.model import mission as m
from marsupial.model.grid import Cell
from marsupial.model.plan import Action, ActionName

MISSION = synthetic_mission()


def text_of(*events: m.MissionEvent) -> bytes:
    return "".join(line + "\n" for line in log_lines(events)).encode("ascii")


def line_of(event: m.MissionEvent) -> str:
    """Return the line of an event that follows the start."""
    return list(log_lines([START, event]))[1]


def read_changed(event: m.MissionEvent, change: Callable[[dict[str, Any]], object]) -> str:
    """Return the message about a log whose second and last event was changed as JSON."""
    value = json.loads(line_of(event))
    change(value)
    with pytest.raises(LogError) as caught:
        parse_log(text_of(START) + json.dumps(value).encode("ascii") + b"\n", source="m.jsonl")
    return str(caught.value)


# Round trips.


def test_a_whole_mission_comes_back_as_it_was(tmp_path: Path) -> None:
    with LogFile(tmp_path / "m.jsonl") as file:
        for event in MISSION:
            file.event(event)
    log = read_log(tmp_path / "m.jsonl")
    assert log.events == MISSION
    assert not log.truncated


@settings(max_examples=300)
@given(later_events)
def test_every_event_comes_back_exactly(event: m.MissionEvent) -> None:
    events = parse_log(text_of(START, event)).events
    assert events == (START, event)
    assert text_of(*events) == text_of(START, event)


@settings(max_examples=100)
@given(starts)
def test_every_mission_comes_back_exactly(event: m.MissionEvent) -> None:
    assert parse_log(text_of(event)).events == (event,)


def test_every_class_of_event_has_a_tag() -> None:
    assert set(EVENTS.values()) == set(m.MissionEvent.__args__)


def test_no_event_has_a_field_that_the_format_uses_itself() -> None:
    assert not {"event", "format", "version"} & {field.name for kind in EVENTS.values() for field in fields(kind)}


# Writing.


def test_the_first_line_says_format_and_version() -> None:
    assert text_of(START).startswith(b'{"event":"mission","format":"marsupial-log","version":3,"t_ms":0,')


def test_a_line_has_its_fields_in_the_order_of_the_class_and_no_spaces() -> None:
    event = m.DriveStarted(t_ms=5, robot="rover1_1", cell=Cell(3, 4), steps="017")
    assert line_of(event) == '{"event":"drive","t_ms":5,"robot":"rover1_1","cell":[3,4],"steps":"017"}'


def test_sets_are_written_in_order() -> None:
    kind = replace(START.types[0], terrains=frozenset({17, 3, 200, 1}))
    assert '"terrains":[1,3,17,200]' in LogEncoder().line(replace(START, types=(kind,)))


def test_numpy_integers_are_written_as_numbers() -> None:
    event = m.DriveEnded(t_ms=np.int64(7), robot="carrier1", cell=Cell(np.int64(3), 4))  # type: ignore[arg-type]
    assert line_of(event) == '{"event":"stand","t_ms":7,"robot":"carrier1","cell":[3,4]}'


def test_a_run_of_cells_begins_so_many_cells_after_the_one_before() -> None:
    seen = m.Revealed(t_ms=5, robot="carrier1", runs=(7, 2, 1, 9, 1, 0, 67, 3, 1))
    assert line_of(seen) == '{"event":"reveal","t_ms":5,"robot":"carrier1","cells":[7,2,1,0,1,0,57,3,1]}'


def test_five_lines_read_the_known_map_from_a_log() -> None:
    known = {}
    for line in map(json.loads, text_of(*MISSION).splitlines()):
        end = 0
        for gap, length, code in zip(*[iter(line.get("cells", ()))] * 3, strict=True):
            known |= dict.fromkeys(range(end + gap, end := end + gap + length), code)
    assert np.array_equal(painted(known), Playback(MISSION).cells_at(MISSION[-1].t_ms).ravel())


def test_each_event_is_on_disk_at_once(tmp_path: Path) -> None:
    with LogFile(tmp_path / "m.jsonl") as file:
        file.event(START)
        file.event(SEEN)
        assert read_log(tmp_path / "m.jsonl").events == (START, SEEN)


def test_a_plan_only_names_what_stood_in_the_one_before_just_the_same() -> None:
    spot = m.MapTarget(name="t", cell=Cell(3, 4), explorers=("rover",), reveal_m2=1.0, frontier_cells=5)
    door = m.MapMeeting(
        name="m", carrier_cell=Cell(1, 1), rover_cell=Cell(1, 2), carrier_type="carrier", rover_type="rover"
    )
    plan = m.Planned(t_ms=0, revision=1, trigger=read_triggers("start"), targets=(spot,), meetings=(door,), actions=())
    smaller = replace(spot, reveal_m2=0.5)
    plans = (plan, plan, replace(plan, targets=(smaller,)), replace(plan, targets=()), plan)
    values = [json.loads(line) for line in log_lines([START, *plans])][1:]
    assert [[isinstance(target, str) for target in value["targets"]] for value in values] == [
        [False], [True], [False], [], [False]
    ]  # fmt: skip
    assert [value["meetings"] for value in values[1:]] == [["m"]] * 4
    assert parse_log(text_of(START, *plans)).events == (START, *plans)


def test_a_plan_that_names_what_was_not_in_the_one_before_is_refused() -> None:
    plan = m.Planned(t_ms=0, revision=1, trigger=read_triggers("start"), targets=(), meetings=(), actions=())
    said = read_changed(plan, lambda line: line["targets"].append("t_9"))
    assert 'line 2: targets[0]: does not stand in the plan before: "t_9"' in said


def test_cells_that_are_seen_twice_are_named() -> None:
    twice = text_of(START, replace(SEEN, runs=[7, 2, 1, 8, 1, 1]))  # type: ignore[arg-type]
    with pytest.raises(LogError, match=r"line 2: cells: must be in ascending order without overlap"):
        parse_log(twice)


def test_nan_and_infinity_are_not_written() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        text_of(replace(START, resolution_m=float("nan")))


# A run that was killed.


def test_a_line_cut_off_at_the_end_is_left_out_and_reported() -> None:
    whole = text_of(*MISSION)
    log = parse_log(whole[:-9])
    assert log.truncated
    assert log.events == MISSION[:-1]


def test_a_last_line_that_only_lacks_its_line_break_is_whole() -> None:
    log = parse_log(text_of(*MISSION)[:-1])
    assert log.events == MISSION
    assert not log.truncated


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le"])
def test_a_log_that_a_shell_of_windows_copied_is_read(encoding: str) -> None:
    text = text_of(*MISSION).decode().replace("\n", "\r\n")
    assert parse_log(text.encode(encoding)).events == MISSION
    assert parse_log(text.encode(encoding)[:-9]).truncated


# Files that are no logs.


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"gone\.jsonl: can't be read: No such file"):
        read_log(tmp_path / "gone.jsonl")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "holds no mission"),
        (b"\x89PNG\r\n\x1a\n", "line 1: is not UTF-8 text"),
        (b"[1,2]\n", r"line 1: must be a JSON object, got \[1, 2\]"),
        (b"{}\n", "line 1: event: must be one of mission, reveal, .*, got null"),
        (b"[" * 100_000 + b"\n", "line 1: is not JSON"),
        (b'{"event":"mission"}\n', 'line 1: format: must be "marsupial-log", got null'),
        (b'{"event":"mission","format":"marsupial-log","version":2}\n', "version: must be 3, got 2: other versions"),
        (text_of(START)[:40], "holds no mission"),
        (text_of(START) + b'{"event":"stand","t_m\n' + text_of(START), "line 2: is not JSON"),
        (text_of(START, START), "line 2: event: a log holds one mission"),
        (text_of(*MISSION).partition(b"\n")[2], "line 1: event: the first event must be the mission"),
        (text_of(*MISSION, MISSION[-1]), "line 50: event: nothing may follow the end of the mission"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_file_that_is_no_log_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(LogError, match=message):
        parse_log(data)


# Wrong fields, each named by line and path.

DRIVE = m.DriveStarted(t_ms=5, robot="rover1_1", cell=Cell(3, 4), steps="017")
MOVE = Action(name=ActionName.MOVE, start_ms=0, duration_ms=5, robot="carrier1", place="m1", origin="s")
BEGIN = m.ActionStarted(t_ms=5, revision=1, action=MOVE, cell=Cell(3, 4))
PLAN = m.Planned(
    t_ms=5,
    revision=1,
    trigger=(),
    targets=(),
    meetings=(),
    actions=(),
    guess=m.GuessedGround(corner=Cell(0, 0), side=4, halls=(), rooms=()),
    instead=(("carrier1", ()),),
)
SEEN = m.Revealed(t_ms=5, robot="rover1_1", runs=(7, 2, 1))


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
        (SEEN, "robot", "rover9", "robot: no such robot: 'rover9'"),
        (SEEN, "cells", [[7, 2, 1]], r"cells\[0\]: must be a whole number, got \[7, 2, 1\]"),
        (SEEN, "cells", [7, 2], "cells: must be three numbers for each run, got 2 numbers"),
        (SEEN, "cells", [7, 2, 255], "cells: has no terrain of code 255; there are 0, 1, 2"),
        (SEEN, "cells", [7, 10_000, 1], "cells: must stay inside the map of 2400 cells"),
        (SEEN, "cells", [-1, 2, 1], "cells: must be in ascending order"),
        (PLAN, "guess.side", 0, "guess.side: must be 1 or more, got 0"),
        (PLAN, "instead", [["rover9", []]], r"instead\[0\]\[0\]: no such robot: 'rover9'"),
        (BEGIN, "action.name", "fly", 'action.name: must be one of move, explore, dock, undock, got "fly"'),
        (BEGIN, "action.name", "dock", "action.robot: a carrier can't be carried"),
        (BEGIN, "action.carrier", "carrier1", "action.carrier: a move has none, got 'carrier1'"),
        (BEGIN, "action.duration_ms", -5, "action.duration_ms: must be 0 or more, got -5"),
        (BEGIN, "action", [], r"action: must be an object, got \[\]"),
        (BEGIN, "cell", [60, 0], r"cell: lies outside the map: \[60, 0\]"),
    ],
)
def test_a_wrong_field_is_named_by_line_and_path(event: m.MissionEvent, path: str, value: Any, message: str) -> None:
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
    value = json.loads(LogEncoder().line(START))
    for terrain in value["terrains"]:
        del terrain["blocks_sight"]
    terrains = parse_log(json.dumps(value).encode("ascii")).events[0].terrains
    assert [terrain.blocks_sight for terrain in terrains] == [False, False, False]


def test_an_integer_is_accepted_for_a_number() -> None:
    value = json.loads(LogEncoder().line(START)) | {"resolution_m": 1}
    assert parse_log(json.dumps(value).encode("ascii")).events[0].resolution_m == 1.0


def test_texts_that_are_not_numbers_are_refused() -> None:
    line = LogEncoder().line(START).replace('"resolution_m":0.25', '"resolution_m":NaN')
    with pytest.raises(LogError, match="line 1: is not JSON: NaN is no finite number"):
        parse_log(line.encode("ascii") + b"\n")


def test_all_wrong_fields_are_reported_at_once() -> None:
    bad = line_of(DRIVE).replace("rover1_1", "rover9").replace("017", "x").encode("ascii")
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
        ({"width": 0}, "width: must be 1 or more, got 0"),
        ({"resolution_m": 0.0}, r"resolution_m: must be positive, got 0\.0"),
        ({"width": 10**9}, "width: must be at most 1000000, got 1000000000"),
        ({"width": 10**5, "height": 10**5}, "width: 100000 x 100000 cells are more than the limit"),
        ({"types": (replace(START.types[0], radius_m=-1.0),)}, r"types\[0\]\.radius_m: must be 0 or more, got -1\.0"),
        ({"types": (replace(START.types[0], speed_mps=0.0),)}, r"types\[0\]\.speed_mps: must be positive"),
        ({"robots": (START.robots[0], START.robots[0])}, "robots: two robots have the same name"),
        ({"robots": (replace(START.robots[0], type="boat"),)}, r"robots\[0\]\.type: no such robot type: 'boat'"),
        ({"robots": (replace(START.robots[0], cell=None),)}, r"robots\[0\]: must have either a cell or a carrier"),
        ({"robots": (replace(START.robots[0], cell=Cell(60, 0)),)}, r"robots\[0\]\.cell: lies outside the map"),
        ({"robots": START.robots[1:]}, r"robots\[0\]\.carrier: no such carrier: 'carrier1'"),
    ],
)
def test_an_inconsistent_mission_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(LogError, match=f"line 1: {message}"):
        parse_log(text_of(replace(START, **change)))


def test_numbers_that_nothing_can_be_made_of_are_refused() -> None:
    line = line_of(m.DriveEnded(t_ms=1, robot="carrier1", cell=Cell(1, 1))).replace("[1,1]", f"[{10**30},1]")
    with pytest.raises(LogError, match=r"line 2: cell\[0\]: must be at most 1e\+15, got 10"):
        parse_log(text_of(START) + line.encode() + b"\n")


# Triggers as text.


@pytest.mark.parametrize(
    ("text", "triggers"),
    [
        ("start", (m.Trigger(m.Cause.START),)),
        ("way blocked: c1, c2", (m.Trigger(m.Cause.WAY_BLOCKED, ("c1", "c2")),)),
        ("gone: t1; new: t2, t3", (m.Trigger(m.Cause.GONE, ("t1",)), m.Trigger(m.Cause.NEW, ("t2", "t3")))),
        ("failed: c1; failed: r1", (m.Trigger(m.Cause.FAILED, ("c1",)), m.Trigger(m.Cause.FAILED, ("r1",)))),
    ],
)
def test_triggers_are_written_as_text_and_read_back(text: str, triggers: tuple[m.Trigger, ...]) -> None:
    assert trigger_text(triggers) == text
    assert read_triggers(text) == triggers


@pytest.mark.parametrize("text", ["", "; ", "start: ", "gone:", "somebody else's words; start", "other: a"])
def test_other_words_are_kept_as_they_are(text: str) -> None:
    assert trigger_text(read_triggers(text)) == text
