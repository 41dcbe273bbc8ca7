from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.missions.synthetic_mission import (
    DOCK,
    EXPLORE,
    EXPLORE_2,
    MOVE,
    RETURN,
    UNDOCK,
    mission_started,
    synthetic_mission,
    truth,
)

from marsupial.mission.playback import Playback
from marsupial.mission.state import RobotView
from marsupial.model import OBSTACLE, UNKNOWN, ActionEnd, ActionEnded, ActionStarted, Cell, DriveStarted, RobotLost

EVENTS = synthetic_mission()


def robots(playback: Playback, t_ms: int) -> dict[str, RobotView]:
    return {view.name: view for view in playback.robots_at(t_ms)}


def where(playback: Playback, robot: str, t_ms: int) -> tuple[float, float]:
    view = robots(playback, t_ms)[robot]
    return pytest.approx((view.x, view.y))  # type: ignore[return-value]


@pytest.fixture
def playback() -> Playback:
    return Playback(EVENTS)


# Positions of robots.


@pytest.mark.parametrize(
    ("robot", "t_ms", "place"),
    [
        ("carrier1", 0, (6, 20)),
        ("carrier1", 250, (7, 20)),  # 0.25 m at 1 m/s
        ("carrier1", 375, (7.5, 20)),
        ("carrier1", 5_000, (26, 20)),
        ("carrier1", 26_005, (26, 20)),
        ("rover1_1", 375, (7.5, 20)),  # aboard
        ("rover1_1", 5_000, (26, 20)),
        ("rover1_1", 5_001, (28, 20)),  # set down at the meeting point
        ("rover1_1", 10_002, (28, 20)),
        ("rover1_1", 10_502, (29, 20)),  # 0.25 m at 0.5 m/s
        ("rover1_1", 12_502, (33, 20)),  # stopped on the way
        ("rover1_1", 13_003, (34, 20)),
        ("rover1_1", 14_254, (31.5, 20)),
        ("rover1_1", 20_000, (28, 20)),  # docking
        ("rover1_1", 26_005, (26, 20)),  # aboard again
        ("rover1_2", 26_005, (26, 20)),
    ],
)
def test_a_robot_is_where_the_events_put_it(
    playback: Playback, robot: str, t_ms: int, place: tuple[float, float]
) -> None:
    assert where(playback, robot, t_ms) == place


def test_a_diagonal_step_takes_the_root_of_two_as_long() -> None:
    drive = DriveStarted(t_ms=0, robot="carrier1", cell=Cell(6, 20), steps="13")
    playback = Playback([mission_started(), drive, replace(EVENTS[-1], t_ms=1_000)])
    assert where(playback, "carrier1", 354) == (7, 21)  # 0.25 sqrt 2 m at 1 m/s
    assert where(playback, "carrier1", 707) == (6, 22)


def test_a_moment_outside_the_mission_counts_as_its_start_or_end(playback: Playback) -> None:
    assert playback.robots_at(-5) == playback.robots_at(0)
    assert playback.robots_at(99_999) == playback.robots_at(26_005)


@given(st.integers(0, 26_005))
def test_carriers_and_carried_rovers_agree(t_ms: int) -> None:
    team = robots(Playback(EVENTS), t_ms)
    for robot in team.values():
        assert all(team[name].carrier == robot.name for name in robot.cargo)
        if robot.carrier is not None:
            assert robot.name in team[robot.carrier].cargo


@pytest.mark.parametrize(
    ("t_ms", "cargo"),
    [
        (5_000, ("rover1_1", "rover1_2")),
        (5_001, ("rover1_2",)),  # from the start of the undock on
        (26_004, ("rover1_2",)),
        (26_005, ("rover1_1", "rover1_2")),  # from the end of the dock on
    ],
)
def test_a_rover_is_aboard_until_its_undock_starts_and_once_its_dock_ends(
    playback: Playback, t_ms: int, cargo: tuple[str, ...]
) -> None:
    assert robots(playback, t_ms)["carrier1"].cargo == cargo


def test_a_dock_that_failed_leaves_the_rover_outside() -> None:
    events = [
        replace(event, end=ActionEnd.LOST) if isinstance(event, ActionEnded) and event.action == DOCK else event
        for event in EVENTS
    ]
    assert robots(Playback(events), 26_005)["rover1_1"].carrier is None


# Actions of robots.


@pytest.mark.parametrize(
    ("robot", "t_ms", "action"),
    [
        ("carrier1", 0, MOVE),
        ("carrier1", 5_000, None),
        ("carrier1", 5_001, UNDOCK),
        ("rover1_1", 5_001, UNDOCK),
        ("rover1_2", 5_001, None),
        ("rover1_1", 10_001, None),
        ("rover1_1", 12_000, EXPLORE),
        ("rover1_1", 12_502, None),
        ("carrier1", 20_000, DOCK),
        ("carrier1", 26_005, None),
    ],
)
def test_the_action_of_a_robot_is_the_one_that_runs(playback: Playback, robot: str, t_ms: int, action: object) -> None:
    assert robots(playback, t_ms)[robot].action == action


def test_the_timeline_of_a_robot_lists_its_actions_and_how_they_ended(playback: Playback) -> None:
    assert [(s.start_ms, s.end_ms, s.revision, s.action, s.end) for s in playback.timeline["rover1_1"]] == [
        (5_001, 10_001, 1, UNDOCK, ActionEnd.DONE),
        (10_002, 12_502, 1, EXPLORE, ActionEnd.SUPERSEDED),
        (12_503, 13_003, 2, EXPLORE_2, ActionEnd.BLOCKED),
        (13_004, 16_004, 2, RETURN, ActionEnd.DONE),
        (16_005, 26_005, 2, DOCK, ActionEnd.DONE),
    ]
    assert [s.action for s in playback.timeline["carrier1"]] == [MOVE, UNDOCK, DOCK]
    assert playback.timeline["rover1_2"] == ()


def test_an_action_that_runs_when_the_log_stops_has_no_end() -> None:
    cut = [event for event in EVENTS if event.t_ms <= 7_000]
    playback = Playback([*cut, replace(EVENTS[1], t_ms=7_000, runs=())])
    last = playback.timeline["rover1_1"][-1]
    assert (last.start_ms, last.end_ms, last.action, last.end) == (5_001, 7_000, UNDOCK, None)
    assert playback.ended is None


def test_an_action_whose_end_is_missing_ends_where_the_next_starts() -> None:
    second = replace(RETURN, robot="carrier1", start_ms=2_000)
    events = [
        mission_started(),
        ActionStarted(t_ms=0, revision=1, action=MOVE, cell=Cell(26, 20)),
        ActionStarted(t_ms=2_000, revision=2, action=second, cell=Cell(8, 20)),
    ]
    assert [(s.start_ms, s.end_ms, s.end) for s in Playback(events).timeline["carrier1"]] == [
        (0, 2_000, None),
        (2_000, 2_000, None),
    ]


def test_a_lost_robot_is_lost_from_then_on() -> None:
    events = [mission_started(), RobotLost(t_ms=5, robot="rover1_2", reason="battery"), replace(EVENTS[-1], t_ms=9)]
    playback = Playback(events)
    assert [robots(playback, t_ms)["rover1_2"].lost for t_ms in (4, 5, 9)] == [False, True, True]
    assert not robots(playback, 9)["carrier1"].lost


def test_the_plan_in_force_is_the_last_one_made(playback: Playback) -> None:
    revisions = [playback.plan_at(t_ms) for t_ms in (0, 12_501, 12_502, 26_005)]
    assert [plan.revision if plan else None for plan in revisions] == [1, 1, 2, 2]
    assert playback.plan_at(-1) is None


def test_a_mission_of_one_event_can_be_played() -> None:
    playback = Playback([mission_started()])
    assert playback.duration_ms == 0
    assert where(playback, "rover1_2", 0) == (6, 20)
    assert playback.coverage_at(0).seen_m2 == 0.0


# The known map.


@pytest.mark.parametrize("t_ms", [0, 2_000, 12_000, 26_005])
def test_the_known_map_is_true(playback: Playback, t_ms: int) -> None:
    cells = playback.cells_at(t_ms)
    known = cells != UNKNOWN
    assert known[20, 6]
    assert np.array_equal(cells[known], truth()[known])


def test_the_map_is_the_same_whichever_way_one_comes_to_it(playback: Playback) -> None:
    forward = [playback.cells_at(t_ms) for t_ms in range(0, 26_000, 1_000)]
    backward = [playback.cells_at(t_ms) for t_ms in reversed(range(0, 26_000, 1_000))]
    assert all(np.array_equal(a, b) for a, b in zip(forward, reversed(backward), strict=True))


def test_a_map_that_was_handed_out_stays_as_it_is(playback: Playback) -> None:
    early = playback.cells_at(0)
    before = early.copy()
    playback.cells_at(26_005)
    assert np.array_equal(early, before)


@pytest.mark.parametrize("t_ms", [0, 2_000, 12_000, 26_005])
def test_coverage_is_the_area_of_the_known_map(playback: Playback, t_ms: int) -> None:
    cells = playback.cells_at(t_ms)
    point = playback.coverage_at(t_ms)
    assert point.seen_m2 == np.sum(cells != UNKNOWN) / 16
    assert point.open_m2 == np.sum((cells != UNKNOWN) & (cells != OBSTACLE)) / 16


def test_coverage_has_one_point_a_moment_and_never_shrinks(playback: Playback) -> None:
    times = [point.t_ms for point in playback.coverage]
    areas = [point.seen_m2 for point in playback.coverage]
    assert times == sorted(set(times))
    assert areas == sorted(areas)
