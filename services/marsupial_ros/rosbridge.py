"""A reconnecting client of rosbridge: subscriptions and action goals over one websocket.

Messages sent without a connection are dropped; the listener learns of each new connection and may resend them. Messages
arrive as JSON, in fragments if they are large, or as CBOR if the subscription requests it.

References: rosbridge v2.0 protocol specification for ROS 2 (RobotWebTools/rosbridge_suite, `ROSBRIDGE_PROTOCOL.md`).
"""

import asyncio
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import cbor2
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidProxy, InvalidURI, WebSocketException

from marsupial.errors import UsageError
from marsupial_client import ProxyUnusable
from marsupial_client.proxies import EnvironmentProxy, proxy_for
from marsupial_ros.messages import UNREADABLE
from marsupial_ros.transport import STATIC, ActionResult, GoalStatus, Listener, Refusal, Subscription, first_of

# pauses between attempts to connect
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.2, 5.0
# how long a connection may take to open
OPEN_S = 10.0
# how long rosbridge may take to confirm a close
CLOSE_S = 2.0
# interval of pings; a connection without an answer for as long is dead
PING_S = 5.0
# the largest message: a map of 100 million cells as JSON
MOST_BYTES = 512 * 2**20

MOST_FRAGMENTS = 100_000

# close code of a websocket for a message over the limit of its receiver
TOO_LONG = 1009


class Rosbridge:
    """Talks to the rosbridge at `url` (``ws://host:9090``) while `run` runs."""

    name = "rosbridge"
    hint = "rosbridge's own log says what it refuses, except maps over its max_message_size"
    _listener: Listener

    def __init__(self, url: str, subscriptions: list[Subscription]) -> None:
        self.url = url
        self._subscriptions = subscriptions
        # rosbridge shares subscriptions by literal names, and only the first client of one gets all latched messages:
        # so ask by relative names, which hardly any client does
        self._literal = {one.topic: one.topic.removeprefix("/") for one in subscriptions}
        self._heard: set[str] = set()
        self._goal_lengths: dict[str, int] = {}  # of the goals of this connection
        self._outbox: asyncio.Queue[str] | None = None
        self.servers: frozenset[str] | None = None  # the action servers that rosapi lists
        self.servers_known = False  # whether rosapi has answered: it may not run
        self._fragments: dict[str, dict[int, str]] = {}
        self._readers: Mapping[str, Callable[[Mapping[str, Any]], None]] = {
            "publish": self._published,
            "action_feedback": lambda message: self._listener.feedback(str(message.get("id")), message["values"]),
            "action_result": self._action_ended,
            "service_response": self._on_servers,
            "status": self._on_status,
            "fragment": self._fragment,
        }

    @property
    def open(self) -> bool:
        return self._outbox is not None

    def send_goal(self, goal: str, action: str, type: str, values: Mapping[str, Any]) -> None:
        document = {"op": "send_action_goal", "id": goal, "action": action, "action_type": type}
        self._goal_lengths[goal] = self._send({**document, "args": values, "feedback": True})

    def cancel_goal(self, goal: str, action: str) -> None:
        self._send({"op": "cancel_action_goal", "id": goal, "action": action})

    def ask_for_servers(self, actions: Mapping[str, str]) -> None:
        """Ask rosapi, which usually runs beside rosbridge, which action servers there are."""
        self._send({"op": "call_service", "id": "marsupial:servers", "service": "/rosapi/action_servers", "args": {}})

    def renew(self) -> None:
        """Subscribe again to silent topics and static transforms, by their other names.

        rosbridge chooses the QoS anew, which suits publishers that came later; it may run in a namespace, or share the
        subscription with another client, where some latched messages are lost.
        """
        for one in self._subscriptions:
            if one.topic not in self._heard or one.topic.endswith(STATIC):
                literal = self._literal[one.topic]
                self._send({"op": "unsubscribe", "id": f"marsupial:{one.topic}", "topic": literal})
                bare = one.topic.removeprefix("/")
                self._literal[one.topic] = one.topic if literal == bare else bare
                self._subscribe(one)

    def _subscribe(self, one: Subscription) -> None:
        topic = self._literal[one.topic]
        self._send({"op": "subscribe", "id": f"marsupial:{one.topic}", **asdict(one), "topic": topic})

    async def run(self, listener: Listener) -> None:
        """Connect, reconnect, and pass messages to the listener. Raises UsageError if address or proxy is invalid."""
        self._listener = listener
        try:
            await self._run(proxy_for(self.url))
        except ProxyUnusable as error:
            raise UsageError(f"rosbridge: {error}") from error

    async def _run(self, proxy: EnvironmentProxy | None) -> None:
        asked = "" if proxy is None else f" (asked {proxy})"
        pause_s = FIRST_PAUSE_S
        while True:
            try:
                async with connect(
                    self.url,
                    proxy=None if proxy is None else proxy.url,
                    max_size=MOST_BYTES,
                    open_timeout=OPEN_S,
                    ping_interval=PING_S,
                    ping_timeout=PING_S,
                    close_timeout=CLOSE_S,
                ) as connection:
                    pause_s = FIRST_PAUSE_S
                    try:
                        await self._communicate(connection)
                    finally:
                        # with code 1000: an exception that leaves the block would close it as an error
                        await connection.close()
                        if connection.close_code == TOO_LONG:
                            self._fail_longest()
                reason = "closed by rosbridge"
            except InvalidURI as error:
                raise UsageError(f"rosbridge: {error}") from error
            except (ImportError, InvalidProxy) as error:
                if proxy is None:
                    raise
                socks = "install what websockets needs for SOCKS (pip install 'python-socks[asyncio]')"
                raise proxy.unusable(socks if isinstance(error, ImportError) else error.msg) from error
            except (OSError, TimeoutError, WebSocketException) as error:
                reason = (str(error) or type(error).__name__) + asked
            self._listener.disconnected(reason)
            # longer each time: a rosbridge that is starting refuses connections for a while
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)

    async def flush(self) -> None:
        """Wait until everything sent has left the buffer, if there is a connection."""
        if self._outbox is not None:
            await self._outbox.join()

    async def _communicate(self, connection: ClientConnection) -> None:
        # the rest of an interrupted message never arrives
        self._fragments.clear()
        self._heard.clear()
        self._goal_lengths.clear()
        self._outbox = asyncio.Queue()
        try:
            for one in self._subscriptions:
                self._subscribe(one)
            self._listener.connected()
            await first_of(self._read(connection), self._write(connection, self._outbox))
        finally:
            self._outbox = None

    def _send(self, document: Mapping[str, Any]) -> int:
        """Send a message, if there is a connection, and return its length."""
        text = json.dumps(document)
        if self._outbox is not None:
            self._outbox.put_nowait(text)
        return len(text)

    async def _write(self, connection: ClientConnection, outbox: asyncio.Queue[str]) -> None:
        while True:
            text = await outbox.get()
            await connection.send(text)
            outbox.task_done()

    async def _read(self, connection: ClientConnection) -> None:
        async for data in connection:
            self._take(data)

    def _take(self, data: str | bytes) -> None:
        """Dispatch a message; an unreadable one is reported and ignored."""
        try:
            document = json.loads(data) if isinstance(data, str) else cbor2.loads(data)
            reader = self._readers.get(document["op"])
            if reader is not None:
                reader(document)
        except (*UNREADABLE, RecursionError, cbor2.CBORDecodeError) as error:
            self._listener.warning(f"rosbridge sent an invalid message ({error!r})")

    def _published(self, document: Mapping[str, Any]) -> None:
        literal = document["topic"]
        topic = next((topic for topic, name in self._literal.items() if name == literal), literal)
        self._heard.add(topic)
        self._listener.message(topic, document["msg"])

    def _fail_longest(self) -> None:
        """Fail the goal for which rosbridge has closed the connection: sent again, it would do so each time."""
        goal = max(self._goal_lengths, key=self._goal_lengths.__getitem__, default=None)
        if goal is not None:
            why = f"{self._goal_lengths[goal]} bytes are more than rosbridge's max_message_size"
            self._listener.ended(ActionResult(goal, GoalStatus.ABORTED, why))

    def _action_ended(self, document: Mapping[str, Any]) -> None:
        status = int(document.get("status", GoalStatus.SUCCEEDED if document.get("result") else GoalStatus.UNKNOWN))
        values = document.get("values")
        refused = status == GoalStatus.UNKNOWN and document.get("result") is False
        self._listener.ended(
            ActionResult(str(document.get("id")), status, values, _refusal(values) if refused else None)
        )

    def _on_servers(self, document: Mapping[str, Any]) -> None:
        self.servers_known = True
        self.servers = frozenset(document["values"]["action_servers"]) if document.get("result") else None

    def _on_status(self, document: Mapping[str, Any]) -> None:
        if document.get("level") in ("error", "warning"):
            self._listener.warning(f"rosbridge: {document.get('msg')}")

    def _fragment(self, document: Mapping[str, Any]) -> None:
        name, total = str(document["id"]), int(document["total"])
        if not 0 < total <= MOST_FRAGMENTS:
            raise ValueError(f"{total} fragments")
        parts = self._fragments.setdefault(name, {})
        parts[int(document["num"])] = str(document["data"])
        if len(parts) == total:
            del self._fragments[name]
            self._take("".join(parts[number] for number in range(total)))


def _refusal(text: object) -> Refusal:
    """Return why a goal has not begun, by the words of rosbridge."""
    if "action server" in str(text).lower():
        return Refusal.ABSENT
    return Refusal.REJECTED if "rejected" in str(text).lower() else Refusal.UNSENT
