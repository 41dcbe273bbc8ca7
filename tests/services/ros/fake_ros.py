"""A fake rosbridge with simple simulated robots: the part of the published protocol that the bridge uses.

Simulated time is published on ``/clock``. Robots follow their paths and sense cells in line of sight. They share one
map, which covers the known area and so grows and shifts; every second map is published as an update.
"""

from __future__ import annotations

import asyncio
import json
import math
import random
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import cbor2
import numpy as np
from ros_faults import Faults, Message, absolute, link_of, time_of, turned, xyz
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from marsupial.maps.footprint import Contact
from marsupial.model import OBSTACLE, UNKNOWN, Grid, RobotType
from marsupial.sim.sensors import FieldOfView

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
STEP_S = 0.1
JITTER_M = 0.02
STOP_SHORT_M = 0.1
"""Robots stop this far from their goals, as controllers with tolerances do."""

DOCK_RANGE_M = 1.0
SHUFFLE_M = 0.15
SPEEDUP = 40.0


@dataclass
class SimulatedRobot:
    """The true state of a robot."""

    name: str
    kind: RobotType
    at: tuple[float, float]
    carrier: str | None = None
    yaw: float = 0.0
    silent: bool = False
    stamp_s: float | None = None
    """A constant stamp for all its transforms; None for current stamps."""
    stuck: bool = False
    """Whether it moves to and fro without progress."""
    goal: Goal | None = None


@dataclass
class Goal:
    """A goal in progress."""

    id: str
    action: str
    args: Message
    robot: SimulatedRobot
    path: list[tuple[float, float]] = field(default_factory=list)
    until_s: float = 0.0
    connection: ServerConnection | None = None
    feedback: bool = False


@dataclass
class Client:
    """A connected client, and the compression of each topic that it has subscribed to, by its literal name."""

    connection: ServerConnection
    topics: dict[str, str] = field(default_factory=dict)
    deaf: set[str] = field(default_factory=set)
    """Topics without a publisher when they were subscribed to: best effort does not match later."""


class FakeRos:
    """A server that runs within an `async with` block.

    `goals` are all received goals, `cancelled` the ids of all cancel requests, `closes` the clients' close codes.
    `faults` go wrong. Simulated time runs `speedup` times as fast; `edit_map` changes maps before they are published,
    and `maps` has what is published on each topic of a map; `links` are more static transforms.
    """

    def __init__(self, truth: Grid, robots: list[SimulatedRobot], *, speedup: float = SPEEDUP) -> None:
        self.truth = truth
        self.robots = {robot.name: robot for robot in robots}
        self.known = np.full_like(truth.cells, UNKNOWN)
        self.now_s = 100.0
        self.faults = Faults()
        self.goals: list[Message] = []
        self.cancelled: list[str] = []
        self.unknown_ops: list[str] = []
        self.connections = 0
        self.closes: list[int | None] = []
        self.edit_map: Callable[[Message], Message] = lambda message: message
        self.maps: dict[str, Callable[[Message], Message]] = {"/map": lambda message: message}
        self.links: list[Message] = []
        self.port = 0
        self.done: dict[tuple[str, int], int] = {}
        self.speedup = speedup
        self._clients: list[Client] = []
        self._running: dict[str, Goal] = {}
        self._draw = random.Random(1)
        self._sensor = FieldOfView()
        self._drawn = 0
        self._box: tuple[int, int, int, int] | None = None

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    @property
    def running(self) -> list[str]:
        return [goal.action for goal in self._running.values()]

    async def __aenter__(self) -> FakeRos:
        self._server = await serve(self._serve_client, "127.0.0.1", self.port, max_size=None)
        self.port = self._server.sockets[0].getsockname()[1]
        self._sense()  # before a client can subscribe to the map
        self._loop = asyncio.ensure_future(self._run())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._loop.cancel()
        await asyncio.gather(self._loop, return_exceptions=True)
        self._server.close()
        await self._server.wait_closed()

    async def cut(self) -> None:
        """Break all connections; goals continue, and their results are lost."""
        for client in list(self._clients):
            client.connection.transport.abort()
        await asyncio.sleep(0)

    # protocol

    def attach(self, connection: Any) -> Callable[[Message], Coroutine[Any, Any, None]]:
        """Add a client that is no websocket: it gets texts by `send`, and sends messages by the function returned."""
        client = Client(connection)
        self._clients.append(client)
        return partial(self._handle, client)

    async def _serve_client(self, connection: ServerConnection) -> None:
        self.connections += 1
        client = Client(connection)
        self._clients.append(client)
        try:
            async for text in connection:
                if len(text) > (self.faults.limit or math.inf):
                    await connection.close(1009, "message too big")
                    break
                await self._handle(client, json.loads(text))
        except ConnectionClosed:
            pass
        finally:
            self._clients.remove(client)
            self.closes.append(connection.close_code)

    async def _handle(self, client: Client, message: Message) -> None:
        operation = message["op"]
        if operation == "subscribe":
            await self._subscribe(client, message["topic"], message.get("compression", "none"))
        elif operation == "unsubscribe":
            del client.topics[message["topic"]]
        elif operation == "call_service":
            await self._call(client, message)
        elif operation == "send_action_goal":
            await self._accept(client, message)
        elif operation == "cancel_action_goal":
            await self._cancel(message["id"])
        else:
            self.unknown_ops.append(operation)  # rosbridge only logs them

    async def _call(self, client: Client, message: Message) -> None:
        """Answer a call of rosapi's service that lists the action servers."""
        assert message["service"] == "/rosapi/action_servers"
        drives = {f"/{name}/follow_path" for name in self.robots}
        docks = {f"/{name}/{word}" for name, r in self.robots.items() if r.kind.dock_ms for word in ("dock", "undock")}
        values = {"action_servers": sorted((drives | docks) - self.faults.absent)} if self.faults.rosapi else "no such"
        answer = {"op": "service_response", "service": message["service"], "id": message["id"], "values": values}
        await self._send_json(client.connection, {**answer, "result": self.faults.rosapi})

    async def _subscribe(self, client: Client, topic: str, compression: str) -> None:
        """Subscribe, and send what is latched: to the first client with this literal name all, to others one."""
        first = topic not in self.faults.held and not any(topic in other.topics for other in self._clients)
        client.topics[topic] = compression
        (client.deaf.add if absolute(topic) in self.faults.late else client.deaf.discard)(topic)
        latched: dict[str, Callable[[], list[Message]]] = {"/tf_static": self._static}
        for name, part in self.maps.items():
            latched[name] = lambda part=part: [part(self._map())]  # type: ignore[misc]
        messages = latched[absolute(topic)]() if absolute(topic) in latched else []
        for message in messages if first else messages[:1]:
            await self._send(client, topic, message)

    async def _accept(self, client: Client, message: Message) -> None:
        self.goals.append(message)
        name = message["action"].split("/")[1]
        robot = self.robots[name]
        if (why := self.faults.refusal(message["action"])) is not None:
            if self.faults.answers:
                document = {"op": "action_result", "id": message["id"], "action": message["action"], "values": why}
                await self._send_json(client.connection, {**document, "status": 0, "result": False})
            return
        goal = Goal(message["id"], message["action"], message["args"], robot, connection=client.connection)
        goal.feedback = message.get("feedback", False)
        kind = message["action"].rsplit("/", 1)[1]
        if message["action"] in self.faults.failing:
            await self._end(goal, ABORTED, {"success": False, "message": "ramp blocked"})
            return
        if kind in ("dock", "undock"):
            key = (goal.args["mission"], goal.args["command"])
            if key in self.done:  # a repetition of the same goal
                await self._end(goal, self.done[key], {"success": self.done[key] == SUCCEEDED, "message": ""})
                return
            before = next((g for g in self._running.values() if self._key(g) == key), None)
            goal.until_s = self.now_s + self._takes_s(goal) if before is None else before.until_s
            if before is not None:
                del self._running[before.id]
        else:
            await self._replace(robot)
            poses = goal.args["path"]["poses"] if kind == "follow_path" else [goal.args["pose"]]
            goal.path = [(p["pose"]["position"]["x"], p["pose"]["position"]["y"]) for p in poses]
            robot.goal = goal
        self._running[goal.id] = goal

    async def take_over(self, name: str, *path: tuple[float, float]) -> None:
        """Send a robot along a path, as an operator does from another program."""
        robot = self.robots[name]
        await self._replace(robot)
        robot.goal = Goal(f"operator:{name}", f"/{name}/follow_path", {}, robot, list(path))
        self._running[robot.goal.id] = robot.goal

    async def _replace(self, robot: SimulatedRobot) -> None:
        """End the goal of a robot as nav2 ends one that is replaced: aborted, without code or text."""
        if robot.goal is not None:
            await self._end(robot.goal, ABORTED, {"error_code": 0, "error_msg": ""})

    @staticmethod
    def _key(goal: Goal) -> tuple[str, int] | None:
        return (goal.args["mission"], goal.args["command"]) if "command" in goal.args else None

    def _takes_s(self, goal: Goal) -> float:
        kind = goal.robot.kind
        return (kind.dock_ms if goal.action.endswith("/dock") else kind.undock_ms) / 1000

    async def _cancel(self, name: str) -> None:
        self.cancelled.append(name)
        if self.faults.ignored_cancels:
            self.faults.ignored_cancels -= 1
        elif name in self._running:
            await self._end(self._running[name], CANCELED, {})

    async def _end(self, goal: Goal, status: int, values: Message) -> None:
        self._running.pop(goal.id, None)
        if goal.robot.goal is goal:
            goal.robot.goal = None
        key = self._key(goal)
        if key is not None and status != CANCELED:
            self.done[key] = status
        document = {"op": "action_result", "id": goal.id, "action": goal.action, "values": values, "status": status}
        if goal.connection is not None:
            await self._send_json(goal.connection, {**document, "result": True})

    async def _send_json(self, connection: ServerConnection, document: Message) -> None:
        with suppress(ConnectionClosed):
            await connection.send(json.dumps(document))

    async def _publish(self, topic: str, message: Message) -> None:
        for client in list(self._clients):
            for literal in [one for one in client.topics if absolute(one) == topic and one not in client.deaf]:
                if topic not in self.faults.late:
                    await self._send(client, literal, message)

    async def _send(self, client: Client, topic: str, message: Message) -> None:
        document = {"op": "publish", "topic": topic, "msg": message}
        try:
            if client.topics[topic] == "cbor":
                if "data" in message:
                    packed = cbor2.CBORTag(72, np.asarray(message["data"], np.int8).tobytes())
                    document = {**document, "msg": {**message, "data": packed}}
                await client.connection.send(cbor2.dumps(document))
            else:
                await client.connection.send(json.dumps(document))
        except ConnectionClosed:
            pass

    def _static(self) -> list[Message]:
        """Return the latched transforms: one message of each publisher."""
        links = [link_of("map", "odom", (0.0, 0.0), 0.0, 0.0)]
        links += [link_of(f"{name}/base_footprint", f"{name}/base_link", (0.0, 0.0), 0.0, 0.0) for name in self.robots]
        return [{"transforms": [link]} for link in links + self.links]

    # simulation

    async def _run(self) -> None:
        while True:
            await asyncio.sleep(STEP_S / self.speedup)
            self.now_s += STEP_S
            for goal in list(self._running.values()):
                await self._advance(goal)
            self._sense()
            await self._publish_state()

    async def _advance(self, goal: Goal) -> None:
        if goal.path:
            if goal.feedback and goal.connection is not None:
                left_m = sum(math.dist(a, b) for a, b in pairwise([goal.robot.at, *goal.path]))
                values = {"distance_to_goal": left_m, "speed": goal.robot.kind.speed_mps}
                await self._send_json(goal.connection, {"op": "action_feedback", "id": goal.id, "values": values})
            if goal.robot.stuck:
                goal.robot.at = (goal.robot.at[0] + (SHUFFLE_M if self._drawn % 2 else -SHUFFLE_M), goal.robot.at[1])
            elif _follow_path(goal.robot, goal.path, goal.robot.kind.speed_mps * STEP_S):
                await self._end(goal, SUCCEEDED, {"error_code": 0})
            return
        if self.now_s < goal.until_s:
            return
        rover, carrier = self.robots[goal.args["rover"]], self.robots[goal.args["carrier"]]
        if goal.action.endswith("/dock"):
            near = math.dist(rover.at, carrier.at) <= DOCK_RANGE_M and rover.carrier is None
            rover.carrier = carrier.name if near else None
        else:
            near = rover.carrier == carrier.name
            place = goal.args["pose"]["pose"]["position"]
            rover.carrier, rover.at = None, (place["x"], place["y"])
        values = {"success": near, "message": "" if near else "not beside each other"}
        await self._end(goal, SUCCEEDED if near else ABORTED, values)

    def _sense(self) -> None:
        for robot in self.robots.values():
            if robot.carrier is not None:
                continue
            cell = self.truth.cell_at_m(*robot.at)
            touched = Contact(robot.kind, self.truth.resolution_m).touched(self.truth.cells, cell)
            for seen in (self._sensor.visible(self.truth, robot.kind, cell), touched):
                self.known.ravel()[seen] = self.truth.cells.ravel()[seen]

    async def _publish_state(self) -> None:
        await self._publish("/clock", {"clock": time_of(self.now_s)})
        links = []
        for robot in self.robots.values():
            at = self.robots[robot.carrier].at if robot.carrier else robot.at
            noisy = (at[0] + self._draw.uniform(-1, 1) * JITTER_M, at[1] + self._draw.uniform(-1, 1) * JITTER_M)
            if not robot.silent:
                stamp_s = self.now_s if robot.stamp_s is None else robot.stamp_s
                links.append(link_of("odom", f"{robot.name}/base_footprint", noisy, robot.yaw, stamp_s))
        await self._publish("/tf", {"transforms": links})
        self._drawn += 1
        if self._drawn % self.faults.map_steps == 0 and not self.faults.stalled:
            await self._publish_map(update=self._drawn % (2 * self.faults.map_steps) == 0)

    async def _publish_map(self, *, update: bool) -> None:
        if update and self._known_box() == self._box:
            whole = self._map()
            size = {"x": 0, "y": 0, "width": whole["info"]["width"], "height": whole["info"]["height"]}
            await self._publish("/map_updates", {"header": whole["header"], **size, "data": whole["data"]})
        else:
            for topic, part in self.maps.items():
                await self._publish(topic, part(self._map()))

    def _known_box(self) -> tuple[int, int, int, int]:
        rows, columns = np.nonzero(self.known != UNKNOWN)
        if not len(rows):
            return 0, 0, 1, 1
        return int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1

    def _map(self) -> Message:
        left, low, right, high = self._box = self._known_box()
        cells = self.known[low:high, left:right]
        data = np.select([cells == UNKNOWN, cells == OBSTACLE], [-1, 100], 0).astype(np.int8)
        x, y = self.truth.point_m(left, low)
        origin = {"position": xyz(x, y), "orientation": turned(0.0)}
        resolution = float(np.float32(self.truth.resolution_m))
        info = {"resolution": resolution, "width": right - left, "height": high - low, "origin": origin}
        return self.edit_map(
            {"header": {"frame_id": "map", "stamp": time_of(self.now_s)}, "info": info, "data": data.ravel().tolist()}
        )


def _follow_path(robot: SimulatedRobot, path: list[tuple[float, float]], step_m: float) -> bool:
    """Move a robot along its path; return whether it has arrived within tolerance."""
    while path and step_m > 0:
        gap = math.dist(robot.at, path[0])
        if len(path) == 1 and gap <= STOP_SHORT_M:
            path.clear()
        elif gap <= step_m:
            robot.at, step_m = path.pop(0), step_m - gap
        else:
            share = step_m / gap
            robot.yaw = math.atan2(path[0][1] - robot.at[1], path[0][0] - robot.at[0])
            robot.at = tuple(a + share * (b - a) for a, b in zip(robot.at, path[0], strict=True))  # type: ignore[assignment]
            step_m = 0.0
    return not path
