"""The simulated robots of `fake_ros` as a node of a real ROS 2: their topics, and an action server for each action.

The node has a context and threads of its own, so it meets the node under test through the middleware only.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import time
from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import Any

import rclpy
from fake_ros import ABORTED, CANCELED, SUCCEEDED, FakeRos
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosidl_runtime_py.set_message import set_message_fields
from rosidl_runtime_py.utilities import get_action, get_message

from marsupial_ros.goals import DOCK_TYPE, DRIVE_TYPES, UNDOCK_TYPE
from marsupial_ros.messages import CLOCK_TYPE, MAP_TYPE, TF_TYPE, UPDATE_TYPE
from marsupial_ros.native.ros_node import fields_of
from marsupial_ros.settings import DriveAction

THREADS = 16  # each goal under way holds one
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TOPICS = {
    "/map": (MAP_TYPE, LATCHED),
    "/map_updates": (UPDATE_TYPE, QoSProfile(depth=10)),
    "/tf": (TF_TYPE, QoSProfile(depth=100)),
    "/tf_static": (TF_TYPE, LATCHED),
    "/clock": (CLOCK_TYPE, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)),
}
ACTIONS = {"follow_path": DRIVE_TYPES[DriveAction.FOLLOW_PATH], "dock": DOCK_TYPE, "undock": UNDOCK_TYPE}
ENDS: dict[int, Callable[[Any], None]] = {
    SUCCEEDED: lambda goal: goal.succeed(),
    CANCELED: lambda goal: goal.canceled(),
    ABORTED: lambda goal: goal.abort(),
}


class RealRobots:
    """The node; make it in the event loop of the robots, within their `async with` block.

    `serve` adds action servers: of all robots but those of `Faults.absent`, which can be served later.
    """

    def __init__(self, ros: FakeRos) -> None:
        self._ros = ros
        self._loop = asyncio.get_running_loop()
        self._handle = ros.attach(self)
        self._names = (f"goal{number}" for number in itertools.count())
        self._goals: dict[str, tuple[Any, Future[dict[str, Any]]]] = {}
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = Node("robots", context=self._context)
        self._types = {topic: get_message(type) for topic, (type, _) in TOPICS.items()}
        self._publishers = {
            topic: self._node.create_publisher(self._types[topic], topic, qos) for topic, (_, qos) in TOPICS.items()
        }
        self._servers: dict[str, ActionServer] = {}
        self.serve()
        self._executor = MultiThreadedExecutor(THREADS, context=self._context)
        self._executor.add_node(self._node)
        self._thread = Thread(target=self._executor.spin, daemon=True)
        self._thread.start()
        for topic in TOPICS:
            self._tell({"op": "subscribe", "topic": topic})

    def serve(self) -> None:
        """Add the action servers that are not absent."""
        for robot in self._ros.robots.values():
            for word, type in ACTIONS.items():
                name = f"/{robot.name}/{word}"
                fits = word == "follow_path" or robot.kind.dock_ms
                if fits and name not in self._ros.faults.absent and name not in self._servers:
                    self._servers[name] = self._server(name, get_action(type))

    def close(self) -> None:
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    async def send(self, text: str) -> None:
        """Take what the robots send, as a connection of rosbridge."""
        document = json.loads(text)
        if document["op"] == "publish":
            self._publishers[document["topic"]].publish(_filled(self._types[document["topic"]](), document["msg"]))
        elif document["op"] == "action_feedback" and document["id"] in self._goals:
            goal, _ = self._goals[document["id"]]
            if goal.is_active:
                kind = get_action(ACTIONS["follow_path"])
                goal.publish_feedback(_filled(kind.Feedback(), document["values"]))
        elif document["op"] == "action_result":
            self._goals[document["id"]][1].set_result(document)

    def _server(self, name: str, kind: Any) -> ActionServer:
        refused = lambda _: GoalResponse.REJECT if self._ros.faults.refusal(name) else GoalResponse.ACCEPT  # noqa: E731
        return ActionServer(
            self._node,
            kind,
            name,
            lambda goal: self._execute(name, kind, goal),
            callback_group=ReentrantCallbackGroup(),
            goal_callback=refused,
            cancel_callback=self._cancel,
        )

    def _execute(self, action: str, kind: Any, goal: Any) -> Any:
        """Pass a goal to the robots, and wait for its end."""
        name, over = next(self._names), Future()  # type: ignore[var-annotated]
        self._goals[name] = goal, over
        values = fields_of(goal.request)
        self._tell({"op": "send_action_goal", "id": name, "action": action, "args": values, "feedback": True})
        document = over.result()
        while document["status"] == CANCELED and not goal.is_cancel_requested:
            time.sleep(0.01)  # it is soon: the robots are quicker than the answer to the request
        ENDS[document["status"]](goal)
        return _filled(kind.Result(), document["values"])

    def _cancel(self, goal: Any) -> CancelResponse:
        for name, (other, _) in self._goals.items():
            if other.goal_id == goal.goal_id:
                self._tell({"op": "cancel_action_goal", "id": name})
        return CancelResponse.ACCEPT

    def _tell(self, message: dict[str, Any]) -> None:
        """Send a message to the robots, from any thread."""
        asyncio.run_coroutine_threadsafe(self._handle(message), self._loop)


def _filled(message: Any, values: dict[str, Any]) -> Any:
    set_message_fields(message, values)
    return message
