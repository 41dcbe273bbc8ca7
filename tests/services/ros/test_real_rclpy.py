"""The node on a real ROS 2, where there is one: what it publishes comes back as the fields that the bridge reads."""

import asyncio
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("nav_msgs")
pytest.importorskip("tf2_msgs")

from ros_faults import link_of, turned, xyz
from support.waiting import wait_until_async

from marsupial_ros.messages import MAP_TYPE, TF_TYPE, link_in, occupancy_in
from marsupial_ros.native.ros_node import RosNode
from marsupial_ros.native.transport import NativeTransport
from marsupial_ros.transport import ActionResult, Refusal, Subscription


class Heard:
    """A listener that keeps what it gets."""

    def __init__(self) -> None:
        self.messages: dict[str, Any] = {}
        self.ends: list[ActionResult] = []

    def connected(self) -> None: ...

    def disconnected(self, reason: str) -> None: ...

    def message(self, topic: str, message: Any) -> None:
        self.messages[topic] = message

    def feedback(self, goal: str, values: Any) -> None: ...

    def ended(self, end: ActionResult) -> None:
        self.ends.append(end)

    def warning(self, text: str) -> None: ...


async def test_messages_and_absent_servers_of_a_real_ros() -> None:
    node, heard = RosNode("marsupial_test"), Heard()
    transport = NativeTransport(node, [Subscription("~/map", MAP_TYPE), Subscription("~/tf_static", TF_TYPE)])
    work = asyncio.ensure_future(transport.run(heard))
    try:
        origin = {"position": xyz(1.0, 2.0), "orientation": turned(0.0)}
        info = {"resolution": 0.5, "width": 2, "height": 1, "origin": origin}
        node.publisher("~/map", MAP_TYPE)({"header": {"frame_id": "map"}, "info": info, "data": [-1, 100]})
        node.publisher("~/tf_static", TF_TYPE)({"transforms": [link_of("map", "odom", (1.0, 2.0), 0.0, 3.5)]})
        transport.send_goal("g", "/nobody/follow_path", "nav2_msgs/action/FollowPath", {})
        await wait_until_async(lambda: (len(heard.messages) == 2 and heard.ends) or work.done())
        await transport.flush()
    finally:
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)
        node.close()
    occupancy = occupancy_in(heard.messages["~/map"])
    assert (occupancy.values.tolist(), occupancy.origin_m) == ([[-1, 100]], (1.0, 2.0, 0.0))
    assert link_in(heard.messages["~/tf_static"]["transforms"][0])[:2] == ("map", "odom")
    assert [end.refusal for end in heard.ends] == [Refusal.ABSENT]
