"""Missions in which rovers are out of contact."""

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files

import pytest
from listening import Listening
from support.missions import faulty_mission
from support.missions.faulty_mission import explored, yard
from support.missions.small_teams import CORRIDOR, drawn_grid, kinds_of

from marsupial.errors import ScenarioError
from marsupial.formats.loglines import log_lines
from marsupial.formats.missionlog import parse_log
from marsupial.formats.scenario.write import type_fields
from marsupial.mission.belief.belief import Belief
from marsupial.mission.belief.radio import MISSING
from marsupial.mission.rebuild import moment_at
from marsupial.model import ActionStarted, Cell, FrameShift, News, PlacedRobot, Planned, RobotType, Role, Scenario
from marsupial.model.mission import (
    Cause,
    ContactLost,
    ContactRegained,
    DriveEnded,
    MissionEvent,
    Revealed,
    RobotLost,
    RobotReturned,
    Status,
)
from marsupial.sim.world import SimulatedWorld

STRATEGIES = ("temporal", "assignment", "heuristic", "heuristic-plus", "wurm2010")


def with_range(range_m: float | None, faults: str = "", *, interference: bool = False) -> Scenario:
    scenario = yard(faults, interference=interference)
    return replace(scenario, robot_types=tuple(limited(kind, range_m) for kind in scenario.robot_types))


def limited(kind: RobotType, range_m: float | None) -> RobotType:
    return replace(kind, radio_range_m=range_m) if kind.role is Role.ROVER else kind


def of(kind: type[MissionEvent], events: Sequence[MissionEvent]) -> list[MissionEvent]:
    return [event for event in events if isinstance(event, kind)]


def spans(events: Sequence[MissionEvent]) -> list[tuple[str, int, int]]:
    """Return who was out of contact from when to when, as numbers of events."""
    found, since = [], {}
    for number, event in enumerate(events):
        if isinstance(event, ContactLost):
            assert event.robot not in since
            since[event.robot] = number
        elif isinstance(event, ContactRegained):
            found.append((event.robot, since.pop(event.robot), number))
    return found + [(robot, number, len(events)) for robot, number in since.items()]


@pytest.mark.parametrize("interference", [False, True])
@pytest.mark.parametrize("strategy", STRATEGIES)
def test_missions_with_short_radios_are_completed_without_losses(strategy: str, interference: bool) -> None:
    summary, events = explored(with_range(1.0, interference=interference), strategy, steps=2)
    assert (summary.status, summary.coverage) == (Status.COMPLETE, 1.0)
    assert of(ContactLost, events)
    assert interference or not of(RobotLost, events)
    assert parse_log("".join(f"{line}\n" for line in log_lines(events)).encode()).events == tuple(events)
    for robot, lost, heard in spans(events):
        between = events[lost:heard]
        told = max(event.revision for event in of(Planned, events[:lost]))
        assert all(e.revision <= told for e in of(ActionStarted, between) if robot in e.action.robots)
        assert not any(event.robot == robot for event in of(Revealed, between))


def test_a_range_that_covers_the_map_changes_nothing() -> None:
    far, near = explored(with_range(100.0)), explored(with_range(None))
    assert list(far[1][1:]) == list(near[1][1:])
    assert next(log_lines(near[1])).count("radio_range_m") == 0


def test_a_rover_is_where_it_is_expected_unless_it_is_told_otherwise() -> None:
    _, events = explored(with_range(1.0))
    came = 0
    for robot, lost, heard in spans(events):
        expected = events[lost]
        assert isinstance(expected, ContactLost)
        if heard < len(events) and events[heard].t_ms >= expected.wait_ms:
            came += 1
            stands = [(event.t_ms, event.cell) for event in of(DriveEnded, events[lost:]) if event.robot == robot]
            assert (expected.wait_ms, expected.cell) in stands
    assert came


def test_plans_pick_a_rover_up_where_it_waits_and_moments_are_rebuilt() -> None:
    listening = Listening()
    _, events = explored(with_range(1.0), listening)
    last_at = dict(zip((plan.t_ms for plan in of(Planned, events)), listening.asked, strict=False))
    alone = 0
    for t_ms, situation in last_at.items():
        assert moment_at(events, t_ms).survey().situation == situation, f"at {t_ms} ms"
        for rover in situation.of_role(Role.ROVER):
            if rover.type != "rover":
                alone += 1
                assert rover.place is not None
                assert rover.type == f"rover_as_{rover.name}"
                goals = [p for p in situation.places if (situation.travel(rover.type, rover.place, p) or 0) > 0]
                assert set(goals) <= set(situation.meetings)
    assert alone
    causes = {trigger.cause for plan in of(Planned, events) for trigger in plan.trigger}
    assert Cause.CONTACT in causes


def test_a_rover_that_fails_out_of_contact_is_missed_where_it_should_be() -> None:
    fails = "faults: [{fault: stuck, robot: r3, at_s: %s, for_s: 400}]\n"
    _, events = explored(with_range(1.0), "heuristic")
    away = next(event for event in of(ContactLost, events) if event.robot == "r3")
    summary, events = explored(with_range(1.0, fails % ((away.t_ms + 4500) / 1000)), "heuristic")
    lost = of(RobotLost, events)
    assert [(event.robot, event.reason) for event in lost] == [("r3", MISSING)]
    assert summary.status in (Status.COMPLETE, Status.STALLED)
    back = of(RobotReturned, events)
    assert all(event.t_ms > lost[0].t_ms for event in back)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ("radius_m: 0.1, radio_range_m: 0", "robot_types[1].radio_range_m: must be positive, got 0"),
        ("radius_m: 0.1, radio_range_m: far", "robot_types[1].radio_range_m: must be a number"),
        ("radius_m: 0.1, radio_range_m: 100001", "robot_types[1].radio_range_m: must be at most 100000"),
    ],
)
def test_a_wrong_range_is_refused(change: str, problem: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faulty_mission, "YARD", faulty_mission.YARD.replace("radius_m: 0.1", change))
    with pytest.raises(ScenarioError) as caught:
        yard("")
    assert problem in str(caught.value)


def test_only_rovers_have_a_range(monkeypatch: pytest.MonkeyPatch) -> None:
    text = faulty_mission.YARD.replace("radius_m: 0.4", "radius_m: 0.4, radio_range_m: 9")
    monkeypatch.setattr(faulty_mission, "YARD", text)
    with pytest.raises(ScenarioError, match=r"robot_types\[0\]\.radio_range_m: only rovers have it"):
        yard("")


def test_a_range_is_written_only_where_it_is_limited() -> None:
    rover = with_range(7.0).robot_types[1]
    assert type_fields(rover, {1: "floor", 2: "rough"})["radio_range_m"] == 7.0
    assert "radio_range_m" not in type_fields(limited(rover, None), {1: "floor", 2: "rough"})


def test_the_clairvoyant_refuses_limited_contact() -> None:
    with pytest.raises(ScenarioError, match=r"robot_types\[1\]\.radio_range_m: .* limited contact"):
        explored(with_range(5.0), "clairvoyant")


SAY = f"""
import {{ readFileSync }} from "node:fs";
import {{ readMission }} from "{files("marsupial.replay").joinpath("log/model.js")}";
import {{ activity }} from "{files("marsupial.replay").joinpath("text/activity.js")}";
const mission = readMission(readFileSync(0, "utf8"));
console.log(activity(mission, 9000, mission.views(9000), mission.byName.get("r3")).text);
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_page_says_where_a_rover_out_of_contact_is_expected() -> None:
    _, events = explored(with_range(1.0), "heuristic")
    text = "".join(f"{line}\n" for line in log_lines(events))
    command = ["node", "--input-type=module", "-e", SAY]
    said = subprocess.run(command, input=text, capture_output=True, text=True, timeout=60, check=True).stdout
    assert said.strip() == "r3 is out of contact, expected at M2 at 0:18"


@pytest.mark.parametrize("strategy", STRATEGIES[:3])
def test_a_rover_that_starts_out_of_contact_is_fetched(strategy: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = faulty_mission.YARD.replace(
        "{name: r3, type: rover, carrier: c2}", "{name: r3, type: rover, start: [5.25, 4.25]}"
    )
    monkeypatch.setattr(faulty_mission, "YARD", text)
    summary, events = explored(with_range(1.0), strategy)
    assert of(ContactLost, events)[0].robot == "r3"
    assert (summary.status, summary.coverage) == (Status.COMPLETE, 1.0)
    assert summary.reason.endswith("all rovers are aboard")


def test_where_a_rover_is_expected_moves_with_a_frame_that_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = kinds_of()
    world = SimulatedWorld(drawn_grid(*CORRIDOR), kinds, [PlacedRobot(name="r1", type="rover", cell=Cell(3, 1))])
    belief = Belief(world, kinds, (), lambda *_: None)
    belief.advance(0)
    belief.expect("r1", [[Cell(3, 1), Cell(4, 1)]], (Cell(4, 1),), ())
    grown = News(t_ms=500, moved=FrameShift(Cell(2, 5), 9, 11, 8))
    monkeypatch.setattr(world, "advance", lambda until_ms: grown)
    belief.advance(1000)
    assert [(robot.cell, robot.away) for robot in belief.robots()] == [(Cell(6, 6), (Cell(6, 6),))]
