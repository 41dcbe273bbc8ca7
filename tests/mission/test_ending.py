"""How missions end with robots that are lost or out of contact."""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from support.missions.faulty_mission import explored, yard

from marsupial.formats.loglines import log_lines
from marsupial.formats.missionlog import parse_log
from marsupial.library.metrics import Summary
from marsupial.mission.ending import absent
from marsupial.model import Cell, Goal, MissionEvent, RobotReport, Scenario, Status
from marsupial.model.mission import RobotReturned

# at 10 s c1 and c2 drive, r3 is aboard c2, and r1 explores the room at the lower left
R1_OUTSIDE = "{fault: lost, robot: r1, at_s: 10}"
PLACE = "r1 at (6.2, 1.2)"
LOST_CARRIERS = "{fault: lost, robot: c1, at_s: 1}, {fault: lost, robot: c2, at_s: 1}"  # with all rovers


def ended(faults: str, goal: Goal | None = None) -> tuple[Summary, Sequence[MissionEvent]]:
    return explored(replace(with_faults(faults), **({} if goal is None else {"goal": goal})))


def with_faults(faults: str) -> Scenario:
    return yard(f"faults: [{faults}]\n")


def test_a_mission_is_not_complete_with_a_rover_lost_outside_and_names_it() -> None:
    summary, events = ended(R1_OUTSIDE)
    assert (summary.status, summary.lost, summary.coverage) == (Status.STALLED, ("r1",), 1.0)
    assert summary.reason == f"no reachable target is left, but r1 is not aboard; lost: {PLACE}"
    assert summary.exploration_time_s is not None
    assert summary.as_dict()["lost"] == ["r1"]
    assert parse_log("".join(f"{line}\n" for line in log_lines(events)).encode()).events[-1].lost == ("r1",)


def test_a_mission_that_leaves_its_rovers_where_they_are_is_complete_and_names_the_lost_one() -> None:
    summary, _ = ended(R1_OUTSIDE, Goal(recover_rovers=False))
    assert (summary.status, summary.reason) == (Status.COMPLETE, "no reachable target is left; lost: r1 at (5.2, 1.2)")


def test_a_team_is_not_home_with_a_carrier_lost_on_the_way() -> None:
    summary, _ = ended("{fault: lost, robot: c2, at_s: 6}", Goal(return_home=True))
    assert summary.status is Status.STALLED
    assert summary.reason.startswith("no reachable target is left, but c2 is not home; lost: c2 at (")


def test_a_rover_that_is_lost_aboard_is_aboard_and_named() -> None:
    summary, _ = ended("{fault: lost, robot: r3, at_s: 10}")
    assert (summary.status, summary.aboard) == (Status.COMPLETE, ("r1", "r2", "r3"))
    assert summary.reason == "no reachable target is left, all rovers are aboard; lost: r3 aboard c2"


def test_targets_that_only_lost_rovers_could_explore_are_left() -> None:
    summary, _ = ended(", ".join(f"{{fault: lost, robot: {name}, at_s: 1}}" for name in ("r1", "r2", "r3")))
    why = "no reachable target is left, but only r1, r2, r3 could explore the rest; lost: r1 aboard c1, r2 aboard c1, "
    assert (summary.status, summary.reason) == (Status.STALLED, f"{why}r3 aboard c2")
    assert summary.exploration_time_s is None
    assert {left.reason for left in summary.remaining} == {"only r1, r2, r3 could explore it"}


@pytest.mark.parametrize(
    ("faults", "back"),
    [
        (f"{R1_OUTSIDE}, {{fault: returns, robot: r1, at_s: 300}}", "r1"),  # it is fetched
        (f"{LOST_CARRIERS}, {{fault: returns, robot: c2, at_s: 300}}", "c2"),
    ],
)
def test_a_mission_waits_for_a_lost_robot_that_returns(faults: str, back: str) -> None:
    summary, events = ended(faults)
    assert (summary.status, summary.aboard) == (Status.COMPLETE, ("r1", "r2", "r3"))
    assert summary.mission_time_s > 300
    assert back in [event.robot for event in events if isinstance(event, RobotReturned)]


def test_a_mission_that_is_complete_without_a_lost_robot_does_not_wait_for_it() -> None:
    summary, _ = ended("{fault: lost, robot: c2, at_s: 1}, {fault: returns, robot: c2, at_s: 300}")
    assert (summary.status, summary.mission_time_s < 300) == (Status.COMPLETE, True)
    assert "lost, expected back: c2 at (" in summary.reason


def test_robots_out_of_contact_are_named_with_the_place_where_they_are_expected() -> None:
    grid = with_faults(R1_OUTSIDE).grid
    report = RobotReport(name="r1", type="rover", cell=Cell(2, 1), carrier=None, free_at_ms=0)
    robots = [replace(report, away=()), replace(report, name="r2", lost=True), replace(report, name="r3")]
    assert absent(robots, grid) == ["lost: r2 at (1.2, 0.8)", "out of contact: r1 at (1.2, 0.8)"]
