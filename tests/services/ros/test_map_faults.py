"""Maps that leave out robots, and reports that the service refuses."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from ros_missions import drive, robots_in_rooms
from ros_parts import grid_message, tracker_of
from support.services.servers import Server
from support.waiting import wait_until_async

from marsupial_ros.messages import occupancy_in


def half(message: dict[str, Any], x_m: float, *, right: bool) -> dict[str, Any]:
    """Return the part of a map on one side of an x coordinate."""
    info = message["info"]
    position = info["origin"]["position"]
    at = min(max(1, round((x_m - position["x"]) / info["resolution"])), info["width"] - 1)
    cells = np.array(message["data"]).reshape(info["height"], -1)
    cells = cells[:, at:] if right else cells[:, :at]
    x = position["x"] + at * info["resolution"] * right
    origin = {**info["origin"], "position": {**position, "x": x}}
    info = {**info, "width": cells.shape[1], "origin": origin}
    return {**message, "info": info, "data": cells.ravel().tolist()}


async def test_maps_that_leave_out_a_robot_end_no_mission(server: Server, tmp_path: Path) -> None:
    async with robots_in_rooms() as (ros, user):
        ros.edit_map = lambda message: half(message, 1.5, right=False)
        work = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path)))
        await wait_until_async(lambda: "waiting for /map does not contain carrier2" in user.said or work.done())
        ros.edit_map = lambda message: message
        await wait_until_async(lambda: "/carrier2/follow_path" in ros.running or work.done())
        ros.edit_map = lambda message: half(message, 1.5, right=False)
        lacking = "/map does not contain carrier2 (does more than one node"
        await wait_until_async(lambda: any(text.startswith(lacking) for text in user.said) or work.done())
        ros.edit_map = lambda message: message
        outcome = await work
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    assert len([text for text in user.said if text.startswith(lacking)]) == 1
    assert not any("refused" in text for text in user.said)


async def test_what_the_service_refuses_is_left_out_and_told_and_not_stored(server: Server, tmp_path: Path) -> None:
    state = tmp_path / "state.json"
    async with robots_in_rooms() as (ros, user):
        first = asyncio.ensure_future(drive(*user.bridge(server, ros, tmp_path, state)))
        await wait_until_async(lambda: "/carrier1/follow_path" in ros.running)
        first.cancel()
        await asyncio.gather(first, return_exceptions=True)
        _, client = user.bridge(server, ros, tmp_path, state)
        record = json.loads(state.read_text())
        async with client:
            n = (await client.mission(record["mission"])).n
        far = {"name": "carrier1", "pose_m": [500.0, 3.0]}
        record["report"] = {"n": n + 1, "t_ms": 10**6, "robots": [far], "finished": [999]}
        state.write_text(json.dumps(record))
        outcome = await drive(*user.bridge(server, ros, tmp_path, state))
    assert outcome.ended["status"] == "complete", (outcome, user.said)
    told = [text for text in user.said if text.startswith("left out of a report: ")]
    assert any("outside the map" in text for text in told), user.said
    assert any("999" in text for text in told), user.said


def test_a_frame_that_grows_by_unknown_cells_is_reported() -> None:
    tracker = tracker_of([0, 0])
    tracker.changes({"a": (0.5, 0.5)})
    tracker.take(occupancy_in(grid_message([[0, 0, -1]])))
    assert tracker.changes({"a": (0.5, 0.5)}) == ({"width": 3, "height": 1, "origin_m": [0.0, 0.0, 0.0]}, [])
    assert (tracker.in_frame((2.5, 0.5)), tracker.in_frame((3.5, 0.5))) == (True, False)
