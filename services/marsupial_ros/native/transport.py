"""The transport over a node of ROS 2: its own subscriptions and action clients.

Discovery, QoS and lost nodes are the business of ROS: there is no connection to lose. A goal for an action server that
is not there yet, or that rejects it, is refused at once.
"""

import asyncio
from collections.abc import Mapping
from functools import partial
from typing import Any

from marsupial_ros.native.ros_node import ActionServer, RosNode
from marsupial_ros.transport import ActionResult, GoalStatus, Listener, Refusal, Subscription


class NativeTransport:
    """Talks to robots through a node. What begins with ``_at_ros`` runs in the thread of rclpy."""

    name = "ROS 2"
    hint = "a topic of another type or QoS is not heard"
    _listener: Listener

    def __init__(self, node: RosNode, subscriptions: list[Subscription]) -> None:
        self.url = node.name
        self.open = False
        self.servers: frozenset[str] | None = None
        self.servers_known = False
        self._node = node
        self._subscriptions = subscriptions
        self._actions: dict[str, ActionServer] = {}
        self._handles: dict[str, Any] = {}  # of goals that have not ended; None until accepted
        self._cancelled: set[str] = set()  # goals to cancel once they are accepted

    def send_goal(self, goal: str, action: str, type: str, values: Mapping[str, Any]) -> None:
        self._node.call(self._at_ros_send, goal, action, type, values)

    def cancel_goal(self, goal: str, action: str) -> None:
        self._node.call(self._at_ros_cancel, goal)

    def ask_for_servers(self, actions: Mapping[str, str]) -> None:
        self._node.call(self._at_ros_find, actions)

    def renew(self) -> None:
        """Do nothing: ROS finds publishers that come later."""

    async def run(self, listener: Listener) -> None:
        self._listener = listener
        for one in self._subscriptions:
            self._node.subscribe(one.topic, one.type, partial(listener.message, one.topic))
        self.open = True
        listener.connected()
        try:
            await self._node.spin()
        finally:
            self.open = False

    async def flush(self) -> None:
        done = asyncio.Event()
        self._node.call(self._node.pass_on, done.set)
        await done.wait()

    def _at_ros_action(self, name: str, type: str) -> ActionServer:
        if name not in self._actions:
            self._actions[name] = self._node.action(name, type)
        return self._actions[name]

    def _at_ros_find(self, actions: Mapping[str, str]) -> None:
        found = frozenset(name for name, type in actions.items() if self._at_ros_action(name, type).ready)
        self._node.pass_on(self._note_servers, found)

    def _note_servers(self, found: frozenset[str]) -> None:
        self.servers, self.servers_known = found, True

    def _at_ros_send(self, goal: str, action: str, type: str, values: Mapping[str, Any]) -> None:
        server = self._at_ros_action(action, type)
        if not server.ready:
            self._at_ros_end(goal, GoalStatus.UNKNOWN, Refusal.ABSENT.value, Refusal.ABSENT)
            return
        self._handles[goal] = None
        server.send(
            values,
            partial(self._node.pass_on, self._listener.feedback, goal),
            partial(self._at_ros_answer, goal),
            partial(self._at_ros_end, goal),
        )

    def _at_ros_answer(self, goal: str, handle: Any) -> None:
        if handle is None:
            self._at_ros_end(goal, GoalStatus.UNKNOWN, "the goal was rejected", Refusal.REJECTED)
            return
        self._handles[goal] = handle
        if goal in self._cancelled:
            handle.cancel_goal_async()

    def _at_ros_cancel(self, goal: str) -> None:
        if goal not in self._handles:  # it has ended, or has not begun
            return
        self._cancelled.add(goal)
        if self._handles[goal] is not None:
            self._handles[goal].cancel_goal_async()

    def _at_ros_end(self, goal: str, status: int, values: Any, refusal: Refusal | None = None) -> None:
        self._handles.pop(goal, None)
        self._cancelled.discard(goal)
        self._node.pass_on(self._listener.ended, ActionResult(goal, status, values, refusal))
