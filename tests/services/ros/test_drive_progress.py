"""Progress of drives, by tf and by the feedback of their actions."""

import math
from typing import Any

import pytest

pytest.importorskip("websockets")

from ros_parts import FleetBench

from marsupial_ros.robots import MOST_RECOVERIES, Progress
from marsupial_ros.transport import ActionResult


def judged(left_m: list[float], **more: Any) -> str | None:
    """Return the verdicts on a robot that always moves and reports these remaining distances, one per second."""
    progress = Progress()
    for now_s, left in enumerate(left_m):
        progress.apply_position((float(now_s), 0.0), now_s)
        progress.apply_feedback({"distance_remaining": left, **more}, now_s)
    return progress.fault(len(left_m) - 1, 30.0)


def test_a_robot_that_moves_but_gets_no_nearer_is_stuck() -> None:
    assert judged([5.0, 4.8] * 20) == "no progress for 30 s"
    assert judged([5.0 - 0.01 * i for i in range(40)]) is None


def test_a_standing_robot_is_stuck_whatever_its_action_reports() -> None:
    progress = Progress()
    for now_s in range(40):
        progress.apply_position((0.0, 0.0), now_s)
        progress.apply_feedback({"distance_to_goal": 50.0 - now_s}, now_s)
    assert progress.fault(40.0, 30.0) == "no progress for 30 s"


def test_a_longer_path_is_a_new_one_that_must_get_shorter() -> None:
    there = [2.0] * 10 + [10.0 - 0.2 * i for i in range(30)]
    assert judged(there) is None
    assert judged([2.0] * 10 + [10.0] * 30) == "no progress for 30 s"


def test_feedback_without_a_path_and_of_the_previous_path_is_no_reference_for_progress() -> None:
    assert judged([0.0, 0.3] + [9.0 - 0.2 * i for i in range(38)]) is None


def test_recoveries_without_progress_count_as_standing() -> None:
    progress = Progress()
    for number in range(MOST_RECOVERIES + 1):
        assert progress.fault(number, 30.0) is None
        progress.apply_position((float(number), 0.0), number)
        progress.apply_feedback({"number_of_recoveries": number, "distance_remaining": 5.0}, number)
    assert progress.fault(MOST_RECOVERIES, 30.0) == f"{MOST_RECOVERIES} recoveries without progress"
    progress.apply_feedback({"number_of_recoveries": MOST_RECOVERIES, "distance_remaining": 4.5}, MOST_RECOVERIES)
    assert progress.fault(MOST_RECOVERIES, 30.0) is None


def test_old_feedback_is_ignored() -> None:
    progress = Progress()
    progress.apply_feedback({"distance_remaining": 5.0}, 0.0)
    for now_s in range(100):
        progress.apply_position((float(now_s), 0.0), now_s)
    assert progress.fault(99.0, 30.0) is None
    progress.apply_feedback({"distance_remaining": 5.0}, 99.0)
    assert progress.fault(99.0, 30.0) is None


@pytest.mark.parametrize("odd", [None, "3.2", math.nan, math.inf, -1.0, True, [], {}, 0.0])
def test_without_feedback_only_movement_counts(odd: Any) -> None:
    assert judged([odd] * 40, number_of_recoveries=odd) is None
    progress = Progress()
    progress.apply_feedback({}, 0.0)
    assert progress == Progress()


def test_a_drive_without_reported_progress_is_aborted_although_the_robot_moves(bench: FleetBench) -> None:
    bench.drive()
    for now_s in range(123):
        bench.at("carrier1", 2.5 + 0.2 * (now_s % 2), 2.5, now_s)
        bench.fleet.apply_feedback("m:1:0.1", {"distance_to_goal": 6.0}, now_s)
        bench.fleet.watch(float(now_s))
    assert bench.fleet.report()["failed"] == [{"id": 1, "reason": "no progress for 120 s"}]
    assert bench.actions.cancelled == ["m:1:0.1"]


def test_feedback_of_an_earlier_or_unknown_goal_is_ignored(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.connected(0.0)  # the drive is resent
    for now_s in range(130):
        bench.at("carrier1", 2.5 + 0.05 * now_s, 2.5, now_s)
        bench.fleet.apply_feedback("m:1:0.1", {"number_of_recoveries": now_s, "distance_to_goal": 6.0}, now_s)
        bench.fleet.apply_feedback("None", {"distance_to_goal": 6.0}, now_s)
        bench.fleet.watch(float(now_s))
    assert bench.fleet.driving
    bench.fleet.ended(ActionResult("m:1:0.2", 4, {}))
    bench.fleet.apply_feedback("m:1:0.2", {"distance_to_goal": 6.0}, 131.0)
    assert bench.fleet.report()["finished"] == [1]


def test_a_robot_has_stopped_when_it_stands_and_not_when_it_makes_no_progress(bench: FleetBench) -> None:
    bench.drive()
    bench.command(1, "stop")
    for now_s in range(10):
        bench.at("carrier1", 2.5 + 0.2 * now_s, 2.5, now_s)
        bench.fleet.apply_feedback("m:1:0.1", {"distance_to_goal": 6.0}, now_s)
        bench.fleet.watch(float(now_s))
    assert bench.fleet.driving


def test_an_aborted_drive_is_cancelled_repeatedly_until_its_end_is_confirmed(bench: FleetBench) -> None:
    bench.drive()
    for now_s in (1.0, 122.0):
        bench.at("carrier1", 2.5, 2.5, now_s)
        bench.fleet.watch(now_s)
    bench.fleet.connected(123.0)
    bench.fleet.cancel_all(124.0)
    assert bench.actions.cancelled == ["m:1:0.1"] * 3
    bench.fleet.ended(ActionResult("m:1:0.1", 5, {}))
    bench.fleet.cancel_all(125.0)
    assert bench.actions.cancelled == ["m:1:0.1"] * 3
