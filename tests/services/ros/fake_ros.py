"""A fake rosbridge with simple simulated robots: the part of the published protocol that the bridge uses.

Simulated time is published on ``/clock``. Robots follow their paths and sense cells in line of sight. They share one
map, which covers the known area and so grows and shifts; every second map is published as an update.
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
STOP_SHORT_M = 0.1
"""Robots stop this far from their goals, as controllers with tolerances do."""

DOCK_RANGE_M = 1.0
SHUFFLE_M = 0.15
SPEEDUP = 40.0

Message = dict[str, Any]


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
    """A connected client, and the compression of each topic that it has subscribed to."""

    connection: ServerConnection
    topics: dict[str, str] = field(default_factory=dict)


class FakeRos:
    """A server that runs within an `async with` block.

    `goals` are all received goals, `cancelled` the ids of all cancel requests, `closes` the clients' close codes.
    Simulated time runs `speedup` times as fast; `edit_map` changes maps before they are published; the next
    `ignored_cancels` cancel requests are ignored.
    """

    def __init__(self, truth: Grid, robots: list[SimulatedRobot], *, speedup: float = SPEEDUP) -> None:
        self.truth = truth
        self.robots = {robot.name: robot for robot in robots}
        self.known = np.full_like(truth.cells, UNKNOWN)
        self.now_s = 100.0
        self.goals: list[Message] = []
        self.cancelled: list[str] = []
        self.unknown_ops: list[str] = []
        self.connections = 0
        self.closes: list[int | None] = []
        self.edit_map: Callable[[Message], Message] = lambda message: message
        self.ignored_cancels = 0
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

    async def _serve_client(self, connection: ServerConnection) -> None:
        self.connections += 1
        client = Client(connection)
        self._clients.append(client)
        try:
            async for text in connection:
                await self._handle(client, json.loads(text))
        except ConnectionClosed:
            pass
        finally:
            self._clients.remove(client)
            self.closes.append(connection.close_code)

    async def _handle(self, client: Client, message: Message) -> None:
        operation = message["op"]
        if operation == "subscribe":
            client.topics[message["topic"]] = message.get("compression", "none")
            await self._send_latched(client, message["topic"])
        elif operation == "send_action_goal":
            await self._accept(client, message)
        elif operation == "cancel_action_goal":
            await self._cancel(message["id"])
        else:
            self.unknown_ops.append(operation)
            text = f"Unknown operation: {operation}."
            await client.connection.send(json.dumps({"op": "status", "level": "error", "msg": text}))

    async def _accept(self, client: Client, message: Message) -> None:
        self.goals.append(message)
        name = message["action"].split("/")[1]
        robot = self.robots[name]
        goal = Goal(message["id"], message["action"], message["args"], robot, connection=client.connection)
        goal.feedback = message.get("feedback", False)
        kind = message["action"].rsplit("/", 1)[1]
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
            if robot.goal is not None:  # a new path replaces the previous one
                await self._end(robot.goal, ABORTED, {})
            poses = goal.args["path"]["poses"] if kind == "follow_path" else [goal.args["pose"]]
            goal.path = [(p["pose"]["position"]["x"], p["pose"]["position"]["y"]) for p in poses]
            robot.goal = goal
        self._running[goal.id] = goal

    @staticmethod
    def _key(goal: Goal) -> tuple[str, int] | None:
        return (goal.args["mission"], goal.args["command"]) if "command" in goal.args else None

    def _takes_s(self, goal: Goal) -> float:
        kind = goal.robot.kind
        return (kind.dock_ms if goal.action.endswith("/dock") else kind.undock_ms) / 1000

    async def _cancel(self, name: str) -> None:
        self.cancelled.append(name)
        if self.ignored_cancels:
            self.ignored_cancels -= 1
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
        assert goal.connection is not None
        await self._send_json(goal.connection, {**document, "result": True})

    async def _send_json(self, connection: ServerConnection, document: Message) -> None:
        with suppress(ConnectionClosed):
            await connection.send(json.dumps(document))

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
                await client.connection.send(cbor2.dumps(document))
            else:
                await client.connection.send(json.dumps(document))
        except ConnectionClosed:
            pass

    async def _send_latched(self, client: Client, topic: str) -> None:
        """Send the latched message of a topic to a new subscriber."""
        if topic == "/map":
            await self._send(client, topic, self._map())
        if topic == "/tf_static":
            links = [_link("map", "odom", (0.0, 0.0), 0.0, 0.0)]
            await self._send(client, topic, {"transforms": links})

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
            if robot.carrier is None:
                self._sense_from(robot)

    def _sense_from(self, robot: SimulatedRobot) -> None:
        cell = self.truth.cell_at_m(*robot.at)
        contact = Contact(robot.kind, self.truth.resolution_m)
        for seen in (self._sensor.visible(self.truth, robot.kind, cell), contact.touched(self.truth.cells, cell)):
            self.known.ravel()[seen] = self.truth.cells.ravel()[seen]

    async def _publish_state(self) -> None:
        await self._publish("/clock", {"clock": _time(self.now_s)})
        links = []
        for robot in self.robots.values():
            at = self.robots[robot.carrier].at if robot.carrier else robot.at
            noisy = (at[0] + self._draw.uniform(-1, 1) * JITTER_M, at[1] + self._draw.uniform(-1, 1) * JITTER_M)
            if not robot.silent:
                stamp_s = self.now_s if robot.stamp_s is None else robot.stamp_s
                links.append(_link("odom", f"{robot.name}/base_footprint", noisy, robot.yaw, stamp_s))
                links.append(
                    _link(f"{robot.name}/base_footprint", f"{robot.name}/base_link", (0.0, 0.0), 0.0, self.now_s)
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
        return self.edit_map({"header": {"frame_id": "map"}, "info": info, "data": data.ravel().tolist()})


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
    """Return a map of 10 x 5 m: a hall, and rooms whose doors (0.5 m) only a rover fits through."""
    return replace(draw(*ROOMS, resolution_m=0.25), origin_m=(-2.0, 1.0, 0.0))


def team(grid: Grid, carriers: int = 2) -> list[SimulatedRobot]:
    """Return carriers in the hall, each with a rover aboard."""
    robots = []
    for i in range(1, carriers + 1):
        at = grid.centre_m(Cell(6 + 26 * (i - 1), 8))
        robots.append(SimulatedRobot(f"carrier{i}", CARRIER, (at[0] + 0.03, at[1] - 0.02)))
        robots.append(SimulatedRobot(f"rover{i}", ROVER, at, carrier=f"carrier{i}"))
    return robots


def settings_text(url: str, robots: list[SimulatedRobot], more: Mapping[str, str] | None = None) -> str:
    """Return settings for a team; `more` maps further fields to their YAML."""
    return "\n".join(_settings_lines(url, robots, more or {})) + "\n"


def _settings_lines(url: str, robots: list[SimulatedRobot], more: Mapping[str, str]) -> Iterator[str]:
    yield from ("format: marsupial-ros", "version: 1", "name: rooms", f"rosbridge: {url}", "clock: /clock")
    defaults = {"waits": "{silent_s: 60, lost_s: 120, stuck_s: 120, handover_s: 120}"}
    yield "planning: {planner: greedy, budget_s: 0.05}"
    yield "robot_types:"
    for kind in {robot.kind.name: robot.kind for robot in robots}.values():
        own = "capacity: 1" if kind is CARRIER else "dock_s: 3, undock_s: 2"
        own += "" if kind.radio_range_m is None else f", radio_range_m: {kind.radio_range_m}"
        yield (
            f"  - {{name: {kind.name}, role: {kind.role}, speed_mps: {kind.speed_mps}, radius_m: {kind.radius_m}, "
            f"sensor_range_m: {kind.sensor_range_m}, terrains: [floor], {own}}}"
        )
    yield "robots:"
    for robot in robots:
        aboard = f", carrier: {robot.carrier}" if robot.carrier else ""
        yield f"  - {{name: {robot.name}, type: {robot.kind.name}{aboard}}}"
    for key, value in {**defaults, **more}.items():
        yield f"{key}: {value}"
