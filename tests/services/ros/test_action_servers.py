"""Action servers that are absent, reject goals or fail, and robots that are lost by that."""

import asyncio
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("websockets")

from ros_missions import BridgeUser, drive, robots_in_rooms
from ros_parts import FleetBench
from support.services.servers import Server
from support.waiting import wait_until_async

import marsupial_ros.bridge as bridges
from marsupial_ros.rosbridge import Rosbridge
from marsupial_ros.team import UnreportedEvents
from marsupial_ros.transport import ActionResult, Refusal

REJECTED = ActionResult("m:1:0.1", 0, "Action goal was rejected", Refusal.REJECTED)


def told(user: BridgeUser, text: str) -> bool:
    return any(said.startswith(text) for said in user.said)


async def test_a_mission_begins_once_each_action_server_is_there(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bridges, "REMIND_S", 0.3)
    async with robots_in_rooms() as (ros, user):
        ros.faults.absent = {"/carrier1/follow_path", "/rover2/undock"}
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        missing = "waiting for /carrier1/follow_path, an action server; /rover2/undock, an action server"
        await wait_until_async(lambda: user.said.count(missing) > 1 or work.done())
        assert not any(text.startswith(Rosbridge.hint) for text in user.said[user.said.index(missing) :])
        assert ros.goals == []
        ros.faults.absent = set()
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert not told(user, "nav2 of")


@pytest.mark.parametrize(("fault", "answers"), [("absent", True), ("rejecting", True), ("rejecting", False)])
async def test_action_servers_that_take_no_goals_are_no_failures_of_their_robots(
    server: Server, tmp_path: Path, fault: str, answers: bool
) -> None:
    waits = "{silent_s: 60, lost_s: 120, stuck_s: 20, handover_s: 120}"
    async with robots_in_rooms(waits=waits) as (ros, user):
        ros.faults.rosapi = False  # so nothing is known before the first goal
        ros.faults.answers = answers
        every = {f"/{name}/{action}" for name in ros.robots for action in ("follow_path", "undock")[: 1 + answers]}
        setattr(ros.faults, fault, every)
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: told(user, "nav2 of carrier1 does not accept goals") or work.done())
        await wait_until_async(lambda: len(ros.goals) > 8 or work.done())
        setattr(ros.faults, fault, set())
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert len([text for text in user.said if text.startswith("nav2 of carrier1 does not")]) == 1
    assert told(user, "carrier1: goals are accepted again")
    assert not any("failed" in text or "lost" in text for text in user.said)


def test_a_goal_that_is_not_accepted_is_sent_again_after_pauses_that_grow(bench: FleetBench) -> None:
    bench.drive()
    sent = []
    for tenth in range(1, 400):
        bench.at("carrier1", 2.5, 2.5, tenth / 10)
        if bench.fleet.goals:
            sent.append(tenth // 10)
            bench.fleet.ended(ActionResult(bench.actions.sent[-1][0], 0, "No action server available", Refusal.ABSENT))
        bench.fleet.watch(tenth / 10)
    assert sent == [0, 1, 3, 7, 15, 31]
    assert not bench.fleet.unreported.any
    bench.fleet.watch(62.0)
    bench.fleet.ended(ActionResult(bench.actions.sent[-1][0], 4, {"error_code": 0}))
    assert bench.fleet.report()["finished"] == [1]


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("No action server available", Refusal.ABSENT),
        ("Action goal was rejected", Refusal.REJECTED),
        ("Unable to import msg class Dock", Refusal.UNSENT),
    ],
)
def test_the_words_of_rosbridge_tell_why_a_goal_has_not_begun(text: str, refusal: Refusal) -> None:
    ends: list[ActionResult] = []
    line = Rosbridge("ws://127.0.0.1:1", [])
    line._listener = SimpleNamespace(ended=ends.append)  # type: ignore[assignment]
    line._take(json.dumps({"op": "action_result", "id": "g", "values": text, "status": 0, "result": False}))
    assert ends == [ActionResult("g", 0, text, refusal)]


def test_a_drive_that_no_server_accepts_is_refused_in_the_end_and_can_be_stopped_before(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.ended(REJECTED)
    bench.at("carrier1", 2.5, 2.5, 121.0)
    bench.fleet.watch(121.0)
    assert bench.fleet.report()["declined"] == [{"id": 1, "reason": "accepts no goals for 120 s"}]
    bench.drive()
    bench.fleet.ended(REJECTED)
    bench.command(1, "stop")
    assert bench.fleet.report()["finished"] == [1]


def test_a_goal_without_any_answer_is_cancelled_and_refused_in_the_end(bench: FleetBench) -> None:
    bench.drive()
    for now_s in (1.0, 122.0, 124.0):
        bench.at("carrier1", 2.5, 2.5, now_s)
        bench.fleet.watch(now_s)
    assert "does not accept goals (/carrier1/follow_path: no answer for 120 s)" in bench.said[0]
    assert bench.actions.cancelled == ["m:1:0.1"]
    assert [name for name, *_ in bench.actions.sent] == ["m:1:0.1"]
    assert bench.fleet.report()["declined"] == [{"id": 1, "reason": "no answer for 120 s"}]


def test_a_bridge_that_leaves_waits_for_no_goal_that_was_not_accepted(bench: FleetBench) -> None:
    bench.drive()
    bench.fleet.ended(REJECTED)
    bench.fleet.cancel_all(1.0)
    bench.fleet.connected(2.0)
    assert (bench.fleet.goals, bench.actions.cancelled, len(bench.actions.sent)) == ([], [], 1)


def test_a_robot_that_the_service_counts_as_lost_is_told_and_tried_again(bench: FleetBench) -> None:
    bench.drive()
    for times in (1, 2):
        bench.fleet.count_lost("carrier1", "failed 3 times in a row: aborted", 1000.0)
        bench.fleet.count_lost("rover1", "aboard carrier1, which is lost", 1000.0)
        assert f"it is tried again in {120 * times} s" in bench.said[-2]
        for now_s in (1010.0, 1000.0 + 120 * times - 1):
            bench.at("carrier1", 2.5, 2.5, now_s)
            bench.fleet.watch(now_s)
            assert not bench.fleet.unreported.any
        bench.at("carrier1", 2.5, 2.5, 1000.0 + 120 * times)
        bench.fleet.watch(1000.0 + 120 * times)
        assert sorted(bench.fleet.report()["returned"]) == ["carrier1", "rover1"]
        assert not bench.fleet.robots["rover1"].lost
    assert bench.actions.cancelled == ["m:1:0.1"]


def test_a_rover_lost_aboard_returns_after_a_restart_but_not_before_its_carrier(bench: FleetBench) -> None:
    for lost, returned in ((["rover1"], ["rover1"]), (["carrier1", "rover1"], ["carrier1", "rover1"])):
        bench.fleet.resume({"rover1": "carrier1"}, lost, UnreportedEvents())
        bench.fleet.watch(1.0)
        assert bench.fleet.unreported.returned == lost[:1]
        assert bench.fleet.report()["returned"] == returned


@pytest.mark.parametrize("rejects", [True, False])
async def test_a_mission_that_sets_down_no_rover_does_not_end_complete(
    server: Server, tmp_path: Path, rejects: bool
) -> None:
    async with robots_in_rooms(limits="{time_s: 900}") as (ros, user):
        ros.faults.rejecting = {f"/{name}/undock" for name in ros.robots} if rejects else set()
        ros.faults.failing = set() if rejects else {f"/{name}/undock" for name in ros.robots}
        outcome = await drive(*user.bridge(server, ros, tmp_path))
    assert outcome.ended["status"] in ("stalled", "time_limit"), (outcome, user.said)
    if rejects:
        assert told(user, "the server of /rover1/undock does not accept goals")
    else:
        assert told(user, "rover1: lost: failed 3 times in a row"), user.said
        assert "rover1" in outcome.ended["reason"]
