"""A mission as an MCAP file, for Foxglove, Lichtblick and other readers of MCAP.

Each topic is a generator of messages in order of time; `merge` joins them into one file:

::

    topic                  when                                          message
    /map                   the map changed, at most every second         the known grid
    /tf, /robots/*/pose    every 200 ms while a robot moves              poses
    /robots/*/path         a robot sets out or stops                     its route
    /robots                an activity or a carrier changed              bodies and labels
    /trails                a drive ended, at most every 5 s              all trails and handovers so far
    /plan                  a new plan                                    its targets and who goes to them first
    /log                   a new plan, the end                           a line of text
    /progress              the map changed, at most every second         numbers as JSON

A viewer that jumps to a moment shows the last message of each topic before it. So messages are whole scenes and grids,
never changes to the one before, and their number is bounded so that a viewer can hold them.

References: MCAP format specification, https://mcap.dev/spec; Foxglove message schemas,
https://docs.foxglove.dev/docs/sdk/schemas
"""

import json
from collections.abc import Iterator, Sequence
from functools import cached_property
from heapq import merge
from itertools import pairwise
from math import pi
from typing import IO, Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from google.protobuf.message import Message
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import Writer
from mcap_protobuf.schema import register_schema

from marsupial.exports.ground import box
from marsupial.exports.scene import (
    CHANNELS,
    MAP_FRAME,
    grid_message,
    line_entity,
    place_entity,
    pose,
    robot_entity,
    scene,
    stamp,
)
from marsupial.exports.trails import activity, activity_text, drives, handovers
from marsupial.formats.loglines import trigger_text
from marsupial.mission.playback import Playback
from marsupial.mission.state import Leg, RobotView, Tracks, views
from marsupial.model import UNKNOWN, ActionName, Changed, Grid, MissionEvent, Revealed
from marsupial.model.plan import first_targets
from marsupial.replay.palette import LIGHT, robot_styles

# Poses are small and must look smooth. Maps and trails are written whole each time, so less often.
POSE_EVERY_MS = 200
GRID_EVERY_MS = 1000
TRAIL_EVERY_MS = 5000

# Most bytes of all grids before compression, as viewers keep them: a large map is written less often.
ALL_GRIDS_BYTES = 200_000_000

CARRIER_TRAIL_M, ROVER_TRAIL_M, ROUTE_M = 0.12, 0.05, 0.04
TARGET_M, HANDOVER_M = 0.3, 0.15

NUMBERS = {
    "type": "object",
    "title": "marsupial.Progress",
    "properties": {
        "known_m2": {"type": "number", "description": "known area that is no obstacle"},
        "seen_m2": {"type": "number", "description": "known area, obstacles included"},
        "plans": {"type": "integer", "description": "plans made so far"},
        "doing": {"type": "object", "additionalProperties": {"type": "string"}, "description": "by robot"},
    },
}
"""JSON schema of the topic for plots and tables."""

CHARGES = {
    "type": "object",
    "title": "marsupial.Charges",
    "additionalProperties": {"type": "number"},
    "description": "share of the capacity of each robot's battery, by robot",
}
"""JSON schema of the topic for charges."""

_SCHEMAS = {"/progress": NUMBERS, "/charges": CHARGES}  # of the topics in JSON

TimedMessage = tuple[int, str, Any]
"""A message: its time (ms), its topic, and its content, a protobuf message or a dict for JSON."""


def write_recording(events: Sequence[MissionEvent], out: IO[bytes]) -> None:
    """Write the recording of a mission; the same events give the same bytes."""
    recording = _Recording(Playback(events))
    writer = Writer(out)
    writer.start(library="marsupial")
    writer.add_metadata("mission", recording.facts())
    channels: dict[str, int] = {}
    for number, (t_ms, topic, message) in enumerate(recording.messages()):
        if topic not in channels:
            channels[topic] = _channel(writer, topic, message)
        data = message.SerializeToString(deterministic=True) if isinstance(message, Message) else _json(message)
        time_ns = t_ms * 1_000_000
        writer.add_message(channels[topic], log_time=time_ns, publish_time=time_ns, data=data, sequence=number)
    writer.finish()


def _json(value: dict[str, Any]) -> bytes:
    return json.dumps(value, separators=(",", ":")).encode()


def _channel(writer: Writer, topic: str, message: Any) -> int:
    if isinstance(message, Message):
        return writer.register_channel(topic, MessageEncoding.Protobuf, register_schema(writer, type(message)))
    described = _SCHEMAS[topic]
    schema = writer.register_schema(str(described["title"]), SchemaEncoding.JSONSchema, _json(described))
    return writer.register_channel(topic, MessageEncoding.JSON, schema)


class _Recording:
    """The messages of one mission, topic by topic."""

    def __init__(self, playback: Playback) -> None:
        self.playback = playback
        mission = playback.mission
        size = np.full((mission.height, mission.width), UNKNOWN, dtype=np.uint8)
        self.grid = Grid(cells=size, resolution_m=mission.resolution_m, origin_m=mission.origin_m)
        self.kinds = {kind.name: kind for kind in mission.types}
        self.types = {robot.name: self.kinds[robot.type] for robot in mission.robots}
        self.colours = {name: LIGHT.robot(style) for name, style in robot_styles(mission).items()}
        self.ticks = [*range(playback.start_ms, playback.end_ms, POSE_EVERY_MS), playback.end_ms]

    def facts(self) -> dict[str, str]:
        """Return the metadata: the mission's names and how it ended."""
        mission, ended = self.playback.mission, self.playback.ended
        facts = {"scenario": mission.scenario, "strategy": mission.strategy, "planner": mission.planner}
        status = {} if ended is None else {"status": str(ended.status), "reason": ended.reason}
        return {**facts, "seed": str(mission.seed), **status}

    def messages(self) -> Iterator[TimedMessage]:
        topics = [self._grids(), self._poses(), self._routes(), self._robots(), self._trails(), self._plans()]
        return merge(*topics, self._log(), self._numbers(), self._charges(), key=lambda message: message[0])

    @cached_property
    def _map_changes(self) -> list[int]:
        return sorted({e.t_ms for e in self.playback.events if isinstance(e, Revealed | Changed)})

    def _grids(self) -> Iterator[TimedMessage]:
        # All grids show the part that is known at the end, so their size does not change.
        bottom, top, left, right = box(self.playback.cells_at(self.playback.end_ms) != UNKNOWN)
        size = len(CHANNELS) * (top - bottom) * (right - left)
        every_ms = max(GRID_EVERY_MS, self.playback.duration_ms * size // ALL_GRIDS_BYTES)
        for t_ms in spaced(self._map_changes, every_ms):
            cells = self.playback.cells_at(t_ms)[bottom:top, left:right]
            yield t_ms, "/map", grid_message(self.grid, cells, (left, bottom), LIGHT, t_ms)

    def _pose(self, x: float, y: float, yaw: float) -> Pose:
        return pose(*self._metres(x, y), yaw + self.grid.origin_m[2])

    def _metres(self, x: float, y: float) -> tuple[float, float]:
        """Return a point in metres of the map frame; (0, 0) is the centre of the first cell."""
        return self.grid.point_m(x + 0.5, y + 0.5)

    def _poses(self) -> Iterator[TimedMessage]:
        """Yield the frames of all robots when some have moved, and the poses of those."""
        before: dict[str, tuple[float, float, float]] = {}
        for t_ms in self.ticks:
            tracks = self.playback.tracks_at(t_ms)
            now = {robot.name: (robot.x, robot.y, _yaw(tracks, robot, t_ms)) for robot in views(tracks, t_ms)}
            if now == before:
                continue
            frames = []
            for name, at in now.items():
                placed = self._pose(*at)
                frame = FrameTransform(timestamp=stamp(t_ms), parent_frame_id=MAP_FRAME, child_frame_id=name)
                frame.translation.CopyFrom(placed.position)
                frame.rotation.CopyFrom(placed.orientation)
                frames.append(frame)
                if before.get(name) != at:
                    moved = PoseInFrame(timestamp=stamp(t_ms), frame_id=MAP_FRAME, pose=placed)
                    yield t_ms, f"/robots/{name}/pose", moved
            yield t_ms, "/tf", FrameTransforms(transforms=frames)
            before = now

    def _routes(self) -> Iterator[TimedMessage]:
        """Yield each robot's route when it sets out, and an empty one when it stops."""
        legs: dict[str, Leg | None] = {}
        for number, tracks in self.playback.moments:
            t_ms = self.playback.events[number].t_ms
            for name, track in tracks.items():
                leg = track.where.at
                if name in legs and leg is legs[name]:
                    continue  # the same drive continues
                cells = leg.cells if leg is not None and len(leg.cells) > 1 else ()
                if cells or (legs.get(name) and len(legs[name].cells) > 1):  # type: ignore[union-attr]
                    poses = [self._pose(*cell, 0.0) for cell in corners(cells)]
                    route = PosesInFrame(timestamp=stamp(t_ms), frame_id=MAP_FRAME, poses=poses)
                    yield t_ms, f"/robots/{name}/path", route
                legs[name] = leg

    def _robots(self) -> Iterator[TimedMessage]:
        """Yield the bodies and labels of all robots when a robot's activity or carrier has changed."""
        before: tuple[tuple[str, bool, str | None], ...] = ()
        for number, tracks in self.playback.moments:
            t_ms = self.playback.events[number].t_ms
            robots = views(tracks, t_ms)
            now = tuple((activity_text(robot), robot.lost, robot.carrier) for robot in robots)
            if now != before:
                yield t_ms, "/robots", scene(t_ms, [self._body(t_ms, robot) for robot in robots])
                before = now

    def _body(self, t_ms: int, robot: RobotView) -> SceneEntity:
        kind = self.types[robot.name]
        radius_m = max(kind.radius_m, self.grid.resolution_m)
        height_m = 0.0 if robot.carrier is None else self.types[robot.carrier].radius_m
        label = robot.name if robot.carrier is not None else f"{robot.name}: {activity_text(robot)}"
        colour = LIGHT.dim if robot.lost else self.colours[robot.name]
        return robot_entity(t_ms, robot.name, kind.role, radius_m, colour, label, height_m=height_m)

    def _trails(self) -> Iterator[TimedMessage]:
        """Yield all trails so far, and where rovers were set down and picked up."""
        driven, places = drives(self.playback), handovers(self.playback)
        ends = sorted({int(drive.times_ms[-1]) for found in driven.values() for drive in found})
        for t_ms in spaced(ends, TRAIL_EVERY_MS):
            entities = []
            for robot, found in driven.items():
                thick_m = CARRIER_TRAIL_M if self.types[robot].capacity > 0 else ROVER_TRAIL_M
                look: dict[str, Any] = {"ink": self.colours[robot], "thick_m": thick_m, "alpha": 0.7}
                for k, drive in enumerate(found):
                    if drive.times_ms[-1] <= t_ms:
                        points = [self._metres(*point) for point in corners(drive.cells.tolist())]
                        entities.append(line_entity(t_ms, f"{robot} {k}", points, **look))
            for k, place in enumerate(places):
                if place.t_ms <= t_ms:
                    colour = LIGHT.actions["undock" if place.name is ActionName.UNDOCK else "dock"]
                    at = self._metres(*place.cell)
                    entities.append(place_entity(t_ms, f"{place.name} {k}", at, colour, radius_m=HANDOVER_M))
            yield t_ms, "/trails", scene(t_ms, entities)

    def _plans(self) -> Iterator[TimedMessage]:
        """Yield the targets of each plan, and a line from each robot to its first target."""
        for plan in self.playback.plans:
            robots = {robot.name: robot for robot in self.playback.robots_at(plan.t_ms)}
            cells = {target.name: target.cell for target in plan.targets}
            entities = []
            for k, target in enumerate(plan.targets, 1):
                at, label = self._metres(*target.cell), f"target {k}: about {target.reveal_m2:.0f} m2"
                look: dict[str, Any] = {"radius_m": TARGET_M, "label": label, "ink": LIGHT.ink}
                entities.append(place_entity(plan.t_ms, target.name, at, LIGHT.frontier, **look))
            for name, place in first_targets(plan.actions).items():
                if place in cells:
                    points = [self._metres(robots[name].x, robots[name].y), self._metres(*cells[place])]
                    look = {"ink": self.colours[name], "thick_m": ROUTE_M, "alpha": 0.5}
                    entities.append(line_entity(plan.t_ms, f"{name} goes to", points, **look))
            yield plan.t_ms, "/plan", scene(plan.t_ms, entities)

    def _log(self) -> Iterator[TimedMessage]:
        plans = self.playback.plans
        lines = [(plan.t_ms, "plan", f"plan {plan.revision}: {trigger_text(plan.trigger)}") for plan in plans]
        if (ended := self.playback.ended) is not None:
            lines.append((ended.t_ms, "end", f"{ended.status}: {ended.reason}"))
        for t_ms, about, text in lines:
            yield t_ms, "/log", Log(timestamp=stamp(t_ms), level=Log.Level.INFO, message=text, name=about)

    def _numbers(self) -> Iterator[TimedMessage]:
        times = {self.playback.start_ms, *spaced(self._map_changes, GRID_EVERY_MS), self.playback.end_ms}
        plans = [plan.t_ms for plan in self.playback.plans]
        for t_ms in sorted(times):
            known = self.playback.coverage_at(t_ms)
            doing = {robot.name: str(activity(robot)) for robot in self.playback.robots_at(t_ms)}
            so_far = sum(1 for made in plans if made <= t_ms)
            numbers = {"known_m2": round(known.open_m2, 3), "seen_m2": round(known.seen_m2, 3), "plans": so_far}
            yield t_ms, "/progress", {**numbers, "doing": doing}

    def _charges(self) -> Iterator[TimedMessage]:
        for plan in self.playback.plans:
            if plan.charges:
                yield plan.t_ms, "/charges", dict(plan.charges)


def spaced(times_ms: list[int], every_ms: int) -> list[int]:
    """Return the last of the sorted `times_ms` in each interval of `every_ms`."""
    return [a for a, b in pairwise(times_ms) if a // every_ms != b // every_ms] + times_ms[-1:]


def corners(points: Any) -> list[tuple[float, float]]:
    """Return the points of a line whose direction changes there, and its ends."""
    line = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    steps = np.diff(line, axis=0)
    keep = np.ones(len(line), dtype=np.bool_)
    if len(line) > 2:
        keep[1:-1] = (steps[1:] != steps[:-1]).any(axis=1)
    return [(float(x), float(y)) for x, y in line[keep]]


def _yaw(tracks: Tracks, robot: RobotView, t_ms: int) -> float:
    """Return the heading of a robot, or of its carrier, in radians from the map's x axis."""
    track = tracks[robot.carrier or robot.name]
    leg = track.where.at
    heading = track.heading if leg is None or t_ms >= leg.times_ms[-1] else leg.heading(t_ms)
    return 0.0 if heading is None else heading * pi / 4
