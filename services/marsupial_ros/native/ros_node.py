"""A node of ROS 2 with messages as dictionaries: all that the bridge uses of rclpy.

rclpy runs in a thread of its own, as it waits for messages without asyncio. Whatever is to be called there goes through
`call`; what it receives is passed to the event loop.
"""

from __future__ import annotations

import asyncio
from array import array
from collections.abc import Callable, Coroutine, Mapping
from copy import deepcopy
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions
from rosidl_runtime_py.set_message import set_message_fields
from rosidl_runtime_py.utilities import get_action, get_message, get_service

from marsupial.errors import MarsupialError, UsageError
from marsupial_client import ClientError
from marsupial_ros.messages import MAP_TYPE, TF_TYPE, UPDATE_TYPE
from marsupial_ros.transport import STATIC

# how long rclpy waits for messages before it looks whether the node ends
SPIN_S = 0.1
# how long the caller of a service waits, and with it all messages to the node
ANSWER_S = 2.0
# messages that wait, by type; of others, the latest
DEPTHS = {MAP_TYPE: 1, UPDATE_TYPE: 20, TF_TYPE: 100}

_OVERRIDES = QoSOverridingOptions(
    (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)
)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class RosNode:
    """A node, which receives messages while `spin` runs; close it at the end. Make it in the event loop."""

    def __init__(self, name: str) -> None:
        self._loop = asyncio.get_running_loop()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # goals are cancelled before rclpy ends
        self._node = rclpy.create_node(name)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._ends = False

    @property
    def name(self) -> str:
        return str(self._node.get_fully_qualified_name())

    def say(self, text: str) -> None:
        self._node.get_logger().info(text)

    def parameter(self, name: str, usual: str = "") -> str:
        """Declare a parameter, and return its value."""
        return str(self._node.declare_parameter(name, usual).value)

    @property
    def simulated(self) -> bool:
        """The parameter `use_sim_time`, which every node has."""
        return bool(self._node.get_parameter("use_sim_time").value)

    @property
    def stamp(self) -> dict[str, int]:
        """The time, as fields of `builtin_interfaces/Time`."""
        seconds, nanoseconds = self._node.get_clock().now().seconds_nanoseconds()
        return {"sec": seconds, "nanosec": nanoseconds}

    async def spin(self) -> None:
        """Receive messages until cancelled."""
        work = self._loop.run_in_executor(None, self._spin)
        try:
            await asyncio.shield(work)
        finally:
            self._ends = True
            await asyncio.gather(work, return_exceptions=True)

    def _spin(self) -> None:
        while not self._ends:
            self._executor.spin_once(timeout_sec=SPIN_S)

    def close(self) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def call(self, function: Callable[..., None], *values: Any) -> None:
        """Call a function in the thread of rclpy."""
        self._executor.create_task(function, *values)

    def pass_on(self, function: Callable[..., object], *values: Any) -> None:
        """Call a function in the event loop."""
        self._loop.call_soon_threadsafe(function, *values)

    def subscribe(self, topic: str, type: str, listen: Callable[[dict[str, Any]], None]) -> None:
        """Subscribe to a topic with the usual QoS of its type, unless a parameter overrides it."""
        self._node.create_subscription(
            _class(get_message, type),
            topic,
            lambda message: self.pass_on(listen, fields_of(message)),
            _profile(topic, type),
            qos_overriding_options=_OVERRIDES,
        )

    def publisher(self, topic: str, type: str) -> Callable[[Mapping[str, Any]], None]:
        """Return a function that publishes on a topic; late subscribers get the last message."""
        kind = _class(get_message, type)
        publisher = self._node.create_publisher(kind, topic, _LATCHED, qos_overriding_options=_OVERRIDES)
        return lambda values: publisher.publish(_filled(kind(), values))

    def trigger(self, name: str, act: Callable[[], Coroutine[Any, Any, str]]) -> None:
        """Offer a `std_srvs/Trigger`; `act` runs in the event loop and returns the answer."""

        def answer(_: Any, response: Any) -> Any:
            work = asyncio.run_coroutine_threadsafe(act(), self._loop)
            try:
                response.message, response.success = work.result(ANSWER_S), True
            except (MarsupialError, ClientError) as error:
                response.message, response.success = str(error), False
            except TimeoutError:
                work.cancel()
                response.message, response.success = f"no answer for {ANSWER_S:g} s", False
            return response

        self._node.create_service(_class(get_service, "std_srvs/srv/Trigger"), name, answer)

    def action(self, name: str, type: str) -> ActionServer:
        return ActionServer(ActionClient(self._node, _class(get_action, type), name), _class(get_action, type))


class ActionServer:
    """An action server somewhere; use it in the thread of rclpy only."""

    def __init__(self, client: Any, kind: Any) -> None:
        self._client = client
        self._kind = kind

    @property
    def ready(self) -> bool:
        return bool(self._client.server_is_ready())

    def send(
        self,
        values: Mapping[str, Any],
        feedback: Callable[[dict[str, Any]], None],
        accepted: Callable[[Any], None],
        ended: Callable[[int, dict[str, Any]], None],
    ) -> None:
        """Send a goal: `accepted` gets a handle to cancel it, or None if it was rejected."""

        def answered(future: Any) -> None:
            handle = future.result()
            accepted(handle if handle.accepted else None)
            if handle.accepted:
                handle.get_result_async().add_done_callback(over)

        def over(future: Any) -> None:
            response = future.result()
            ended(int(response.status), fields_of(response.result))

        goal = _filled(self._kind.Goal(), values)
        sent = self._client.send_goal_async(goal, feedback_callback=lambda one: feedback(fields_of(one.feedback)))
        sent.add_done_callback(answered)


def fields_of(value: Any) -> Any:
    """Return a message as a dictionary of its fields, arrays as bytes."""
    if isinstance(value, array):
        return value.tobytes()
    if isinstance(value, list | tuple):
        return [fields_of(one) for one in value]
    if hasattr(value, "get_fields_and_field_types"):
        return {name: fields_of(getattr(value, name)) for name in value.get_fields_and_field_types()}
    return value


def _filled(message: Any, values: Mapping[str, Any]) -> Any:
    set_message_fields(message, deepcopy(values))  # it puts messages in the place of dictionaries
    return message


def _class(find: Callable[[str], Any], type: str) -> Any:
    try:
        return find(type)
    except (ImportError, AttributeError, LookupError, ValueError) as error:
        package = type.partition("/")[0]
        raise UsageError(f"ROS has no {type}: install {package}, or build and source it ({error})") from error


def _profile(topic: str, type: str) -> QoSProfile:
    """Return what publishers usually offer: maps and static transforms are latched."""
    latched = type == MAP_TYPE or topic.endswith(STATIC)
    return QoSProfile(
        depth=DEPTHS.get(type, 1),
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        reliability=ReliabilityPolicy.RELIABLE if type in DEPTHS else ReliabilityPolicy.BEST_EFFORT,
    )
