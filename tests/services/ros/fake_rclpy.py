"""A stand-in for rclpy, in front of the simulated robots of `fake_ros`: what `native.ros_node` uses of it.

Everything it calls back runs in the thread of its executor, as with the real one.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import queue
import sys
from array import array
from collections.abc import Callable, Mapping
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from fake_ros import FakeRos


class FakeMessage:
    """A message whose fields are those it was filled with."""

    def __init__(self, values: Mapping[str, Any] | None = None) -> None:
        self._values: dict[str, Any] = {}
        set_message_fields(self, values or {})

    def __getattr__(self, name: str) -> Any:
        value = self.__dict__["_values"].get(name)
        if isinstance(value, Mapping):
            return FakeMessage(value)
        if name == "data" and isinstance(value, list):
            return array("b", value)
        return [FakeMessage(one) if isinstance(one, Mapping) else one for one in value] if _is_list(value) else value

    def get_fields_and_field_types(self) -> dict[str, str]:
        return dict.fromkeys(self._values, "any")


def _is_list(value: object) -> bool:
    return isinstance(value, list)


def set_message_fields(message: FakeMessage, values: Mapping[str, Any]) -> None:
    message.__dict__["_values"] = dict(values)


class Future:
    """A result to come, set and awaited in the executor's thread."""

    def __init__(self) -> None:
        self._results: list[Any] = []
        self._callbacks: list[Callable[[Future], None]] = []

    def set_result(self, value: Any) -> None:
        self._results.append(value)
        for callback in self._callbacks:
            callback(self)

    def result(self) -> Any:
        return self._results[0]

    def add_done_callback(self, callback: Callable[[Future], None]) -> None:
        self._callbacks.append(callback)
        if self._results:
            callback(self)


class FakeRclpy:
    """The modules of a ROS installation; `missing` packages are not installed.

    `published` has the messages of each topic, `qos` the profile of each subscription, `logged` what the node said.
    """

    def __init__(self, ros: FakeRos, **parameters: Any) -> None:
        self.ros = ros
        self.parameters = {"use_sim_time": False, **parameters}
        self.missing: set[str] = set()
        self.published: dict[str, list[dict[str, Any]]] = {}
        self.qos: dict[str, Any] = {}
        self.logged: list[str] = []
        self.services: dict[str, Callable[[Any, Any], Any]] = {}
        self.open_nodes = 0
        self.queue: queue.Queue[Callable[[], None]] = queue.Queue()
        self.ends: dict[str, Callable[[dict[str, Any]], None]] = {}
        self.feedback: dict[str, Callable[[Any], None]] = {}
        self.listeners: dict[str, Callable[[Any], None]] = {}
        self._loop = asyncio.get_running_loop()
        self._handle = ros.attach(self)
        self._names = itertools.count()

    def install(self, monkeypatch: pytest.MonkeyPatch) -> None:
        enum = SimpleNamespace
        modules: dict[str, dict[str, Any]] = {
            "rclpy": {"init": self.init, "try_shutdown": lambda: None, "create_node": lambda name: FakeNode(self)},
            "rclpy.action": {"ActionClient": lambda node, kind, name: FakeActionClient(self, name)},
            "rclpy.executors": {"SingleThreadedExecutor": lambda: FakeExecutor(self)},
            "rclpy.qos": {
                "DurabilityPolicy": enum(TRANSIENT_LOCAL="transient_local", VOLATILE="volatile"),
                "ReliabilityPolicy": enum(RELIABLE="reliable", BEST_EFFORT="best_effort"),
                "QoSPolicyKind": enum(HISTORY=0, DEPTH=1, RELIABILITY=2, DURABILITY=3),
                "QoSProfile": SimpleNamespace,
            },
            "rclpy.qos_overriding_options": {"QoSOverridingOptions": tuple},
            "rclpy.signals": {"SignalHandlerOptions": enum(NO=0)},
            "rosidl_runtime_py": {},
            "rosidl_runtime_py.set_message": {"set_message_fields": set_message_fields},
            "rosidl_runtime_py.utilities": dict.fromkeys(("get_action", "get_message", "get_service"), self.kind),
        }
        for name, values in modules.items():
            module = ModuleType(name)
            module.__dict__.update(values)
            monkeypatch.setitem(sys.modules, name, module)

    def init(self, *, signal_handler_options: int) -> None:
        assert signal_handler_options == 0

    def kind(self, type: str) -> Any:
        if type.partition("/")[0] in self.missing:
            raise ModuleNotFoundError(f"No module named {type.partition('/')[0]!r}")
        return FakeKind

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send a message to the robots, from any thread."""
        asyncio.run_coroutine_threadsafe(self._handle(dict(message)), self._loop)

    async def send(self, text: str) -> None:
        """Take what the robots send, as a connection of rosbridge."""
        document = json.loads(text)
        if document["op"] == "publish":
            callback, message = self.listeners[document["topic"]], FakeMessage(document["msg"])
            self.queue.put(lambda: callback(message))
        elif document["op"] == "action_feedback" and document["id"] in self.feedback:
            listener, message = self.feedback[document["id"]], FakeMessage({"feedback": document["values"]})
            self.queue.put(lambda: listener(message))
        elif document["op"] == "action_result":
            end = self.ends[document["id"]]
            self.queue.put(lambda: end(document))

    async def trigger(self, name: str) -> tuple[bool, str]:
        """Call a service of the node as another node does."""
        response = SimpleNamespace(success=None, message=None)
        done = asyncio.Event()

        def answer() -> None:
            self.services[name](None, response)
            self._loop.call_soon_threadsafe(done.set)

        self.queue.put(answer)
        await done.wait()
        return response.success, response.message

    def send_goal(self, action: str, values: Mapping[str, Any], feedback: Callable[[Any], None]) -> Future:
        name, sent, result = f"goal{next(self._names)}", Future(), Future()

        def end(document: dict[str, Any]) -> None:
            if document["result"] is not False:
                result.set_result(SimpleNamespace(status=document["status"], result=FakeMessage(document["values"])))

        handle = SimpleNamespace(
            accepted=self.ros.faults.refusal(action) is None,
            cancel_goal_async=lambda: self.tell({"op": "cancel_action_goal", "id": name}),
            get_result_async=lambda: result,
        )
        self.ends[name], self.feedback[name] = end, feedback
        self.tell(
            {
                "op": "send_action_goal",
                "id": name,
                "action": action,
                "action_type": "",
                "args": values,
                "feedback": True,
            }
        )
        self.queue.put(lambda: sent.set_result(handle))
        return sent


class FakeKind(FakeMessage):
    """Any type of message, action or service."""

    Goal = FakeMessage


class FakeNode:
    """A node: it subscribes to topics of the robots, and keeps what it publishes."""

    def __init__(self, rclpy: FakeRclpy) -> None:
        self._rclpy = rclpy
        rclpy.open_nodes += 1

    def get_fully_qualified_name(self) -> str:
        return "/marsupial"

    def get_logger(self) -> Any:
        return SimpleNamespace(info=self._rclpy.logged.append)

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(seconds_nanoseconds=lambda: (1, 2)))

    def declare_parameter(self, name: str, usual: str) -> Any:
        return SimpleNamespace(value=self._rclpy.parameters.get(name, usual))

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self._rclpy.parameters[name])

    def create_subscription(
        self, kind: Any, topic: str, callback: Callable[[Any], None], profile: Any, *, qos_overriding_options: Any
    ) -> None:
        self._rclpy.listeners[topic], self._rclpy.qos[topic] = callback, profile
        self._rclpy.tell({"op": "subscribe", "topic": topic})

    def create_publisher(self, kind: Any, topic: str, profile: Any, *, qos_overriding_options: Any) -> Any:
        messages = self._rclpy.published.setdefault(topic, [])
        return SimpleNamespace(publish=lambda message: messages.append(message._values))

    def create_service(self, kind: Any, name: str, answer: Callable[[Any, Any], Any]) -> None:
        self._rclpy.services[name] = answer

    def destroy_node(self) -> None:
        self._rclpy.open_nodes -= 1


class FakeExecutor:
    """Calls back in the thread that spins it."""

    def __init__(self, rclpy: FakeRclpy) -> None:
        self._queue = rclpy.queue

    def add_node(self, node: FakeNode) -> None:
        pass

    def create_task(self, function: Callable[..., None], *values: Any) -> None:
        self._queue.put(lambda: function(*values))

    def spin_once(self, timeout_sec: float) -> None:
        try:
            work = self._queue.get(timeout=timeout_sec)
        except queue.Empty:
            return
        work()

    def shutdown(self) -> None:
        pass


class FakeActionClient:
    """Sends goals to one action of the robots."""

    def __init__(self, rclpy: FakeRclpy, action: str) -> None:
        self._rclpy = rclpy
        self._action = action

    def server_is_ready(self) -> bool:
        return self._action not in self._rclpy.ros.faults.absent

    def send_goal_async(self, goal: FakeMessage, feedback_callback: Callable[[Any], None]) -> Future:
        return self._rclpy.send_goal(self._action, goal._values, feedback_callback)
