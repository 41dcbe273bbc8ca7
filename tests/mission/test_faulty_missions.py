"""Missions in which robots are lost, return, slow down, get stuck or decline, and ground changes."""

from dataclasses import replace

import pytest
from support.missions.faulty_mission import explored, yard

from marsupial.errors import ScenarioError
from marsupial.formats.loglines import log_lines
from marsupial.formats.missionlog import parse_log
from marsupial.mission.playback import Playback
from marsupial.mission.rebuild import moment_at
from marsupial.model import Planned, RobotReturned, SpeedChanged
from marsupial.model.mission import Cause, Status
from marsupial.model.robots import EnergyModel


@pytest.mark.parametrize("interference", [False, True])
@pytest.mark.parametrize("strategy", ["temporal", "assignment", "heuristic", "heuristic-plus", "wurm2010"])
def test_missions_with_all_faults_are_completed_and_logged(strategy: str, interference: bool) -> None:
    summary, events = explored(yard(interference=interference), strategy, steps=2)
    assert (summary.status, summary.coverage) == (Status.COMPLETE, 1.0)
    assert parse_log("".join(f"{line}\n" for line in log_lines(events)).encode()).events == events
    assert [event.robot for event in events if isinstance(event, RobotReturned)] == ["r3"]
    assert {event.robot: event.share for event in events if isinstance(event, SpeedChanged)} == {"c1": 0.5, "r1": 0.8}
    triggers = {trigger.cause for event in events if isinstance(event, Planned) for trigger in event.trigger}
    assert triggers >= {Cause.LOST, Cause.RETURNED, Cause.SPEED}
    assert not any(robot.lost for robot in Playback(events).robots_at(events[-1].t_ms))


def test_plans_use_a_robot_s_own_speed_and_moments_are_rebuilt_with_it() -> None:
    _, events = explored(yard("faults: [{fault: slows, robot: c1, at_s: 3, speed_share: 0.5}]\n"))
    slow_ms = next(event.t_ms for event in events if isinstance(event, SpeedChanged))
    plan = next(event for event in events if isinstance(event, Planned) and event.t_ms > slow_ms)
    situation = moment_at(events, plan.t_ms).survey().situation
    assert situation.robot_by_name["c1"].type == "carrier_at_50"
    for target in situation.targets:
        full, half = (situation.travel(kind, "s_c1", target.name) for kind in ("carrier", "carrier_at_50"))
        assert full is half is None or half == pytest.approx(2 * full, abs=1)
    drives = {a.duration_ms: a for a in plan.actions if a.robot == "c1" and a.origin == "s_c1"}
    for duration_ms, action in drives.items():
        assert duration_ms == max(1, situation.travel("carrier_at_50", "s_c1", action.place) or 0)


@pytest.mark.parametrize(
    ("faults", "lost_s"),
    [
        ("{fault: lost, robot: r3, at_s: 10}, {fault: returns, robot: r3, at_s: 14}", {"r3": 4}),
        ("{fault: joins, robot: c2, at_s: 20}", {"c2": 20, "r3": 20}),
        (
            "{fault: lost, robot: c2, at_s: 2}, {fault: returns, robot: c2, at_s: 5},"
            "{fault: lost, robot: c2, at_s: 5}, {fault: returns, robot: c2, at_s: 8}",
            {"c2": 6, "r3": 6},
        ),
        ("{fault: lost, robot: r3, at_s: 2}", {"r3": None}),
    ],
)
def test_a_lost_robot_uses_no_energy_until_it_returns(faults: str, lost_s: dict[str, float | None]) -> None:
    scenario = yard(f"faults: [{faults}]\n")
    kinds = (replace(kind, energy=EnergyModel(idle_w=1.0)) for kind in scenario.robot_types)
    summary, _ = explored(replace(scenario, robot_types=tuple(kinds)))
    end_s = summary.mission_time_s
    lost = {name: end_s - 2 if seconds is None else seconds for name, seconds in lost_s.items()}
    expected = {name: end_s - lost.get(name, 0) for name in summary.energy_j_per_robot}
    assert summary.energy_j_per_robot == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("fault", "problem"),
    [
        ("{fault: lost, at_s: 1}", "faults[0].robot: missing: only a random series (rate_per_h) draws its robots"),
        ("{fault: lost, robot: r9, at_s: 1}", "faults[0].robot: unknown robot 'r9'"),
        ("{fault: lost, robot: r1}", "faults[0]: needs one of at_s, rate_per_h, seen_m, got none"),
        ("{fault: lost, robot: r1, at_s: 1, seen_m: [1, 1]}", "got at_s and seen_m"),
        ("{fault: slows, robot: r1, at_s: 1, speed_share: 0}", "faults[0].speed_share: must be positive, got 0"),
        ("{fault: stuck, robot: r1, at_s: 1}", "faults[0].for_s: missing"),
        ("{fault: vanishes, robot: r1, at_s: 1}", "faults[0].fault: must be lost or returns or"),
        ("{fault: ground, area_m: [90, 90, 95, 95], terrain: floor, at_s: 1}", "faults[0].area_m: is outside the map"),
        ("{fault: ground, area_m: [1, 1, 2, 2], terrain: mud, at_s: 1}", "faults[0].terrain: unknown terrain 'mud'"),
        ("{fault: missed_cells, share: 0.1, at_s: 1}", "faults[0].at_s: 'missed_cells' lasts from the start"),
        ("{fault: lost, robot: r1, rate_per_h: 0}", "faults[0].rate_per_h: must be positive, got 0"),
        ("{fault: lost, robot: r1, at_s: 1, colour: red}", "faults[0].colour: unknown field"),
    ],
)
def test_a_fault_that_says_something_wrong_is_refused(fault: str, problem: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        yard(f"faults: [{fault}]\n")
    assert problem in str(caught.value)
