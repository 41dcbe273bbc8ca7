"""The plan that the node shows, from the lines of a mission's log."""

import json

from marsupial_ros.followed_plan import FollowedPlan

TARGET = {"name": "t_1_2", "cell": [1, 2]}
MEETING = {"name": "m_3_4_3_5", "carrier_cell": [3, 5], "rover_cell": [3, 4]}


def line(targets: list[object], meetings: list[object], *actions: tuple[int, str, str]) -> str:
    listed = [{"start_ms": start, "robot": robot, "place": place} for start, robot, place in actions]
    plan = {"event": "plan", "targets": targets, "meetings": meetings, "actions": listed}
    return json.dumps(plan, separators=(",", ":"))


def test_places_of_the_last_plan_may_be_names_alone() -> None:
    plan = FollowedPlan()
    plan.take(line([TARGET], [MEETING], (5, "rover1", "t_1_2"), (0, "carrier1", "m_3_4_3_5")))
    plan.take('{"event":"lost","robot":"carrier2"}')
    assert plan.ways == [("carrier1", "m_3_4_3_5"), ("rover1", "t_1_2")]
    plan.take(line(["t_1_2", "t_9_9"], ["m_3_4_3_5"]))
    assert (plan.targets, plan.meetings) == ({"t_1_2": [1, 2]}, {"m_3_4_3_5": ([3, 5], [3, 4])})
    plan.take(line([], []))
    assert (plan.targets, plan.meetings, plan.ways) == ({}, {}, [])
