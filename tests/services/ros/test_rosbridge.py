"""Messages over rosbridge."""

import asyncio
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

pytest.importorskip("websockets")

from support.waiting import HANG_S
from websockets.asyncio.server import ServerConnection, serve

from marsupial_ros.rosbridge import Rosbridge
from marsupial_ros.transport import ActionResult, Subscription


@dataclass
class Listener:
    heard: list[tuple[str, Mapping[str, Any]]] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    ends: list[ActionResult] = field(default_factory=list)
    fed: list[tuple[str, Mapping[str, Any]]] = field(default_factory=list)
    connections: int = 0

    def connected(self) -> None:
        self.connections += 1

    def disconnected(self, reason: str) -> None:
        self.told.append(reason)

    def message(self, topic: str, message: Mapping[str, Any]) -> None:
        self.heard.append((topic, message))

    def feedback(self, goal: str, values: Mapping[str, Any]) -> None:
        self.fed.append((goal, values))

    def ended(self, end: ActionResult) -> None:
        self.ends.append(end)

    warning = disconnected


def exchange(*sent: str | bytes, times: int = 1) -> tuple[Listener, list[dict[str, Any]]]:
    """Send messages over `times` connections of a rosbridge; return the listener and the requests received."""
    listener, asked = Listener(), []

    async def client(line: ServerConnection) -> None:
        asked.append(json.loads(await line.recv()))
        for one in sent:
            await line.send(one)

    async def run() -> None:
        async with serve(client, "127.0.0.1", 0) as server:
            url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
            work = asyncio.ensure_future(Rosbridge(url, [Subscription("/a", "b")]).run(listener))
            while len([text for text in listener.told if text == "closed by rosbridge"]) < times:
                await asyncio.sleep(0.01)
            work.cancel()
            await asyncio.gather(work, return_exceptions=True)

    asyncio.run(asyncio.wait_for(run(), HANG_S))
    return listener, asked


def test_a_lost_connection_is_reopened_and_subscribes_again() -> None:
    listener, asked = exchange(times=2)
    assert listener.connections >= 2
    one = {"op": "subscribe", "id": "marsupial:/a", "topic": "a", "type": "b", "compression": "none"}
    assert asked[:2] == [one, one]


def test_fragments_are_put_together_in_their_order() -> None:
    text = json.dumps({"op": "publish", "topic": "/a", "msg": {"data": "x" * 50}})
    parts = [text[i : i + 20] for i in range(0, len(text), 20)]
    fragments = [
        json.dumps({"op": "fragment", "id": "1", "data": part, "num": i, "total": len(parts)})
        for i, part in enumerate(parts)
    ]
    assert exchange(*reversed(fragments))[0].heard == [("/a", {"data": "x" * 50})]


def test_invalid_messages_are_reported_and_ignored() -> None:
    listener, _ = exchange(
        "no json",
        b"\xff\xff",
        "[]",
        '{"op": "publish"}',
        '{"op": "other"}',
        '{"op": "action_result", "status": 1e999}',
        '{"op": "action_result", "id": "a", "status": Infinity}',
        '{"op": "fragment", "id": "a", "data": "", "num": 0, "total": Infinity}',
        '{"op": "action_feedback", "id": "a"}',
        "[" * 100_000,
        '{"op": "publish", "topic": "/a", "msg": {}}',
    )
    assert (listener.heard, listener.ends) == ([("/a", {})], [])
    assert len([text for text in listener.told if "an invalid message" in text]) == 9


def test_results_of_goals_and_errors_are_received() -> None:
    end = {"op": "action_result", "id": "m:1:0.1", "action": "/a", "values": {}, "status": 5, "result": True}
    old = {"op": "action_result", "id": "m:1:0.2", "action": "/a", "values": {}, "result": True}
    error = {"op": "status", "level": "error", "msg": "no such type"}
    listener, _ = exchange(json.dumps(end), json.dumps(old), json.dumps(error))
    assert listener.ends == [ActionResult("m:1:0.1", 5, {}), ActionResult("m:1:0.2", 4, {})]
    assert "rosbridge: no such type" in listener.told


def test_feedback_of_any_size_is_received_whole_or_in_fragments() -> None:
    many = [
        json.dumps({"op": "action_feedback", "id": "m:1:0.1", "action": "/a", "values": {"distance_to_goal": i}})
        for i in range(5000)
    ]
    parts = [many[0][:30], many[0][30:]]
    fragments = [
        json.dumps({"op": "fragment", "id": "1", "data": part, "num": i, "total": 2}) for i, part in enumerate(parts)
    ]
    heard = exchange(*many, *fragments)[0].fed
    assert [values["distance_to_goal"] for _, values in heard] == [*range(5000), 0]
    assert {goal for goal, _ in heard} == {"m:1:0.1"}
