"""What a mission needs of ROS: a transport receives topics and carries goals of actions to the robots.

::

    Bridge, RobotFleet ── goals ──► RosTransport ── ROS 2
    RosListener ◄── messages, feedback, ends of goals ──┘

There are two: `rosbridge.Rosbridge` over a websocket, and `native.transport.NativeTransport`, a node of ROS 2 itself.
Goals and messages are dictionaries with the fields of ROS, as in rosbridge's JSON.
"""

import asyncio
from collections.abc import Awaitable, Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from typing import Any, Protocol

# what the topic of static transforms adds to that of the others
STATIC = "_static"


class GoalStatus(IntEnum):
    """How an action ended (`action_msgs/GoalStatus`)."""

    UNKNOWN = 0
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class Refusal(StrEnum):
    """Why a goal has not begun: none of these is a failure of its robot."""

    ABSENT = "no action server"
    REJECTED = "accepts no goals"
    UNSENT = "goals can't be sent"
    UNANSWERED = "no answer"


@dataclass(frozen=True, slots=True)
class ActionResult:
    """The end of a goal: its status, and what the action says about it; a goal with a `refusal` has not begun."""

    goal: str
    status: int
    values: Any
    refusal: Refusal | None = None


@dataclass(frozen=True, slots=True)
class Subscription:
    """A topic, its type, and the encoding of its messages (`compression`), where a transport has several."""

    topic: str
    type: str
    compression: str = "none"


class Listener(Protocol):
    """Receives what a transport hears."""

    def connected(self) -> None:
        """Learn of a new connection: goals sent before, and their ends, may be lost."""

    def disconnected(self, reason: str) -> None: ...

    def message(self, topic: str, message: Mapping[str, Any]) -> None: ...

    def feedback(self, goal: str, values: Mapping[str, Any]) -> None: ...

    def ended(self, end: ActionResult) -> None: ...

    def warning(self, text: str) -> None: ...


class Actions(Protocol):
    """Carries goals to action servers."""

    def send_goal(self, goal: str, action: str, type: str, values: Mapping[str, Any]) -> None:
        """Send a goal, by a name of its own, to an action."""

    def cancel_goal(self, goal: str, action: str) -> None:
        """Cancel a goal; its end is reported as any other."""


class RosTransport(Actions, Protocol):
    """A way to ROS, used while `run` runs: its `name` and `url` for messages to the user, with a `hint` for silence.

    `servers` are the action servers that exist, None if nobody can tell; `servers_known`: whether that is the answer.
    """

    name: str
    url: str
    hint: str
    servers: frozenset[str] | None
    servers_known: bool

    @property
    def open(self) -> bool:
        """Whether there is a connection."""

    def ask_for_servers(self, actions: Mapping[str, str]) -> None:
        """Ask which of these action servers, with their types, there are."""

    def renew(self) -> None:
        """Subscribe again to topics that stay silent, if that can help."""

    async def run(self, listener: Listener) -> None:
        """Pass messages to the listener until cancelled. Raises UsageError if it can't be used."""

    async def flush(self) -> None:
        """Wait until everything has been sent."""


async def first_of(*work: Awaitable[None]) -> None:
    """Run all until the first one ends, then cancel the others; raise the exception of the first one."""
    tasks = [asyncio.ensure_future(part) for part in work]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        task.result()
