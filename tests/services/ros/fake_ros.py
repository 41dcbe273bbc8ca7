"""A small rosbridge with simple robots behind it: the published protocol, as far as a bridge of missions needs it.

Its time is simulated and told on ``/clock``. Robots drive along the paths they are given, see what is in line of sight
and draw one map, which covers what is known so far and so grows and shifts; every second one comes as an update.
"""

from __future__ import annotations

import asyncio
import json
import math
import random
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import cbor2
import numpy as np
from drawn_maps import carrier, draw, rover
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from marsupial.maps.footprint import Contact
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, Cell, Grid, RobotType
from marsupial.sim.sensors import FieldOfView

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
STEP_S = 0.1
JITTER_M = 0.02
SHORT_M = 0.1
"""Robots stop so far from where they should: controllers have tolerances."""

BESIDE_M = 1.0
SHUFFLE_M = 0.15
SPEEDUP = 40.0

Message = dict[str, Any]


@dataclass
class Body:
    """A robot as it really is."""

    name: str
    kind: RobotType
    at: tuple[float, float]
    carrier: str | None = None
    yaw: float = 0.0
    mute: bool = False
    stamp_s: float | None = None
    """The stamp of its transforms, if they are always the same ones."""
    wedged: bool = False
    """It turns and shuffles, but gets nowhere."""
    goal: Goal | None = None


@dataclass
class Goal:
    """A goal under way."""

    id: str
    action: str
    args: Message
    robot: Body
    path: list[tuple[float, float]] = field(default_factory=list)
    until_s: float = 0.0
    line: ServerConnection | None = None
    feedback: bool = False


@dataclass
class Client:
    """Who is connected, and what is subscribed to, with the compression asked for."""

    line: ServerConnection
    topics: dict[str, str] = field(default_factory=dict)


class FakeRos:
    """Runs within a block; `goals` lists all that were sent, `cancelled` the names of those that were to end.

    `speedup` seconds pass there in one. `closes` are the codes that connections were closed with by the other end,
    `redraw` changes maps before they are told, and so many requests to cancel as `stubborn` says are passed over.
    """

    def __init__(self, truth: Grid, bodies: list[Body], *, speedup: float = SPEEDUP) -> None:
        self.truth = truth
        self.bodies = {body.name: body for body in bodies}
        self.known = np.full_like(truth.cells, UNKNOWN)
        self.now_s = 100.0
        self.goals: list[Message] = []
        self.cancelled: list[str] = []
        self.unknown_ops: list[str] = []
        self.connections = 0
        self.closes: list[int | None] = []
        self.redraw: Callable[[Message], Message] = lambda message: message
        self.stubborn = 0
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
        self._server = await serve(self._client, "127.0.0.1", self.port, max_size=None)
        self.port = self._server.sockets[0].getsockname()[1]
        self._look()  # before anybody can ask for the map
        self._life = asyncio.ensure_future(self._live())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._life.cancel()
        await asyncio.gather(self._life, return_exceptions=True)
        self._server.close()
        await self._server.wait_closed()

    async def cut(self) -> None:
        """Break all connections; goals go on, and their ends are told to nobody."""
        for client in list(self._clients):
            client.line.transport.abort()
        await asyncio.sleep(0)

    # the protocol

    async def _client(self, line: ServerConnection) -> None:
        self.connections += 1
        client = Client(line)
        self._clients.append(client)
        try:
            async for text in line:
                await self._hear(client, json.loads(text))
        except ConnectionClosed:
            pass
        finally:
            self._clients.remove(client)
            self.closes.append(line.close_code)

    async def _hear(self, client: Client, message: Message) -> None:
        operation = message["op"]
        if operation == "subscribe":
            client.topics[message["topic"]] = message.get("compression", "none")
            await self._latched(client, message["topic"])
        elif operation == "send_action_goal":
            await self._accept(client, message)
        elif operation == "cancel_action_goal":
            await self._cancel(message["id"])
        else:
            self.unknown_ops.append(operation)
            text = f"Unknown operation: {operation}."
            await client.line.send(json.dumps({"op": "status", "level": "error", "msg": text}))

    async def _accept(self, client: Client, message: Message) -> None:
        self.goals.append(message)
        name = message["action"].split("/")[1]
        body = self.bodies[name]
        goal = Goal(message["id"], message["action"], message["args"], body, line=client.line)
        goal.feedback = message.get("feedback", False)
        kind = message["action"].rsplit("/", 1)[1]
        if kind in ("dock", "undock"):
            key = (goal.args["mission"], goal.args["command"])
            if key in self.done:  # sent again: it is the same goal
                await self._end(goal, self.done[key], {"success": self.done[key] == SUCCEEDED, "message": ""})
                return
            before = next((g for g in self._running.values() if self._key(g) == key), None)
            goal.until_s = self.now_s + self._takes_s(goal) if before is None else before.until_s
            if before is not None:
                del self._running[before.id]
        else:
            if body.goal is not None:  # a new path takes the place of the one before
                await self._end(body.goal, ABORTED, {})
            poses = goal.args["path"]["poses"] if kind == "follow_path" else [goal.args["pose"]]
            goal.path = [(p["pose"]["position"]["x"], p["pose"]["position"]["y"]) for p in poses]
            body.goal = goal
        self._running[goal.id] = goal

    @staticmethod
    def _key(goal: Goal) -> tuple[str, int] | None:
        return (goal.args["mission"], goal.args["command"]) if "command" in goal.args else None

    def _takes_s(self, goal: Goal) -> float:
        kind = goal.robot.kind
        return (kind.dock_ms if goal.action.endswith("/dock") else kind.undock_ms) / 1000

    async def _cancel(self, name: str) -> None:
        self.cancelled.append(name)
        if self.stubborn:
            self.stubborn -= 1
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
        assert goal.line is not None
        await self._answer(goal.line, {**document, "result": True})

    async def _answer(self, line: ServerConnection, document: Message) -> None:
        with suppress(ConnectionClosed):
            await line.send(json.dumps(document))

    async def _publish(self, topic: str, message: Message) -> None:
        for client in list(self._clients):
            if topic in client.topics:
                await self._send(client, topic, message)

    async def _send(self, client: Client, topic: str, message: Message) -> None:
        document = {"op": "publish", "topic": topic, "msg": message}
        try:
            if client.topics[topic] == "cbor":
                if "data" in message:
                    packed = cbor2.CBORTag(72, np.asarray(message["data"], np.int8).tobytes())
                    document = {**document, "msg": {**message, "data": packed}}
                await client.line.send(cbor2.dumps(document))
            else:
                await client.line.send(json.dumps(document))
        except ConnectionClosed:
            pass

    async def _latched(self, client: Client, topic: str) -> None:
        """Send what is held for those who come later."""
        if topic == "/map":
            await self._send(client, topic, self._map())
        if topic == "/tf_static":
            links = [_link("map", "odom", (0.0, 0.0), 0.0, 0.0)]
            await self._send(client, topic, {"transforms": links})

    # the world

    async def _live(self) -> None:
        while True:
            await asyncio.sleep(STEP_S / self.speedup)
            self.now_s += STEP_S
            for goal in list(self._running.values()):
                await self._work(goal)
            self._look()
            await self._tell()

    async def _work(self, goal: Goal) -> None:
        if goal.path:
            if goal.feedback and goal.line is not None:
                left_m = sum(math.dist(a, b) for a, b in pairwise([goal.robot.at, *goal.path]))
                values = {"distance_to_goal": left_m, "speed": goal.robot.kind.speed_mps}
                await self._answer(goal.line, {"op": "action_feedback", "id": goal.id, "values": values})
            if goal.robot.wedged:
                goal.robot.at = (goal.robot.at[0] + (SHUFFLE_M if self._drawn % 2 else -SHUFFLE_M), goal.robot.at[1])
            elif _drive(goal.robot, goal.path, goal.robot.kind.speed_mps * STEP_S):
                await self._end(goal, SUCCEEDED, {"error_code": 0})
            return
        if self.now_s < goal.until_s:
            return
        rover, carrier = self.bodies[goal.args["rover"]], self.bodies[goal.args["carrier"]]
        if goal.action.endswith("/dock"):
            near = math.dist(rover.at, carrier.at) <= BESIDE_M and rover.carrier is None
            rover.carrier = carrier.name if near else None
        else:
            near = rover.carrier == carrier.name
            place = goal.args["pose"]["pose"]["position"]
            rover.carrier, rover.at = None, (place["x"], place["y"])
        said = {"success": near, "message": "" if near else "not beside each other"}
        await self._end(goal, SUCCEEDED if near else ABORTED, said)

    def _look(self) -> None:
        for body in self.bodies.values():
            if body.carrier is None:
                self._see(body)

    def _see(self, body: Body) -> None:
        cell = self.truth.cell_at_m(*body.at)
        contact = Contact(body.kind, self.truth.resolution_m)
        for seen in (self._sensor.visible(self.truth, body.kind, cell), contact.touched(self.truth.cells, cell)):
            self.known.ravel()[seen] = self.truth.cells.ravel()[seen]

    async def _tell(self) -> None:
        await self._publish("/clock", {"clock": _time(self.now_s)})
        links = []
        for body in self.bodies.values():
            at = self.bodies[body.carrier].at if body.carrier else body.at
            shaken = (at[0] + self._draw.uniform(-1, 1) * JITTER_M, at[1] + self._draw.uniform(-1, 1) * JITTER_M)
            if not body.mute:
                stamp_s = self.now_s if body.stamp_s is None else body.stamp_s
                links.append(_link("odom", f"{body.name}/base_footprint", shaken, body.yaw, stamp_s))
                links.append(
                    _link(f"{body.name}/base_footprint", f"{body.name}/base_link", (0.0, 0.0), 0.0, self.now_s)
                )
        await self._publish("/tf", {"transforms": links})
        self._drawn += 1
        if self._drawn % 10 == 0:
            await self._publish_map(update=self._drawn % 20 == 0)

    async def _publish_map(self, *, update: bool) -> None:
        if update and self._known_box() == self._box:
            whole = self._map()
            size = {"x": 0, "y": 0, "width": whole["info"]["width"], "height": whole["info"]["height"]}
            await self._publish("/map_updates", {"header": whole["header"], **size, "data": whole["data"]})
        else:
            await self._publish("/map", self._map())

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
        origin = {"position": _xyz(x, y), "orientation": _turned(0.0)}
        resolution = float(np.float32(self.truth.resolution_m))
        info = {"resolution": resolution, "width": right - left, "height": high - low, "origin": origin}
        return self.redraw({"header": {"frame_id": "map"}, "info": info, "data": data.ravel().tolist()})


def _drive(body: Body, path: list[tuple[float, float]], step_m: float) -> bool:
    """Let a robot get on along its path, and say whether it is at the end, or near enough."""
    while path and step_m > 0:
        gap = math.dist(body.at, path[0])
        if len(path) == 1 and gap <= SHORT_M:
            path.clear()
        elif gap <= step_m:
            body.at, step_m = path.pop(0), step_m - gap
        else:
            share = step_m / gap
            body.yaw = math.atan2(path[0][1] - body.at[1], path[0][0] - body.at[0])
            body.at = tuple(a + share * (b - a) for a, b in zip(body.at, path[0], strict=True))  # type: ignore[assignment]
            step_m = 0.0
    return not path


def _xyz(x: float, y: float) -> Message:
    return {"x": x, "y": y, "z": 0.0}


def _turned(yaw: float) -> Message:
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}


def _time(now_s: float) -> Message:
    return {"sec": int(now_s), "nanosec": int(now_s % 1 * 1e9)}


def _link(parent: str, child: str, at: tuple[float, float], yaw: float, stamp_s: float) -> Message:
    transform = {"translation": _xyz(*at), "rotation": _turned(yaw)}
    return {"header": {"frame_id": parent, "stamp": _time(stamp_s)}, "child_frame_id": child, "transform": transform}


ROOMS = (
    "########################################",
    "#...........#...........#..............#",
    "#...........#...........#..............#",
    "#...........#...........#..............#",
    "#...........#...........#..............#",
    "#####..###########..##########..########",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#......................................#",
    "#######..########..#############..######",
    "#.............#................#.......#",
    "#.............#................#.......#",
    "#.............#................#.......#",
    "#.............#................#.......#",
    "########################################",
)

CARRIER = carrier(radius_m=0.4, range_m=3.0, capacity=1)
ROVER = replace(rover(radius_m=0.1, range_m=2.5), terrains=frozenset({FLOOR}), dock_ms=3000, undock_ms=2000)


def rooms() -> Grid:
    """Return a hall with rooms whose doors, 0.5 m wide, only a rover fits through; 10 x 5 m."""
    return replace(draw(*ROOMS, resolution_m=0.25), origin_m=(-2.0, 1.0, 0.0))


def team(grid: Grid, carriers: int = 2) -> list[Body]:
    """Return carriers in the hall, each with a rover aboard."""
    bodies = []
    for i in range(1, carriers + 1):
        at = grid.centre_m(Cell(6 + 26 * (i - 1), 8))
        bodies.append(Body(f"carrier{i}", CARRIER, (at[0] + 0.03, at[1] - 0.02)))
        bodies.append(Body(f"rover{i}", ROVER, at, carrier=f"carrier{i}"))
    return bodies


def settings_text(url: str, bodies: list[Body], more: Mapping[str, str] | None = None) -> str:
    """Return settings for such a team, and further lines by the field they are of."""
    return "\n".join(_settings_lines(url, bodies, more or {})) + "\n"


def _settings_lines(url: str, bodies: list[Body], more: Mapping[str, str]) -> Iterator[str]:
    yield from ("format: marsupial-ros", "version: 1", "name: rooms", f"rosbridge: {url}", "clock: /clock")
    usual = {"waits": "{silent_s: 60, lost_s: 120, stuck_s: 120, handover_s: 120}"}
    yield "planning: {planner: greedy, budget_s: 0.05}"
    yield "robot_types:"
    for kind in (CARRIER, ROVER):
        own = "capacity: 1" if kind is CARRIER else "dock_s: 3, undock_s: 2"
        yield (
            f"  - {{name: {kind.name}, role: {kind.role}, speed_mps: {kind.speed_mps}, radius_m: {kind.radius_m}, "
            f"sensor_range_m: {kind.sensor_range_m}, terrains: [floor], {own}}}"
        )
    yield "robots:"
    for body in bodies:
        aboard = f", carrier: {body.carrier}" if body.carrier else ""
        yield f"  - {{name: {body.name}, type: {body.kind.name}{aboard}}}"
    for key, value in {**usual, **more}.items():
        yield f"{key}: {value}"
