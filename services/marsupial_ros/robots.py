"""One robot of the team: where it is, as tf tells, and the command it carries out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from marsupial_client.mission_documents import Command
from marsupial_ros.goals import ActionGoal
from marsupial_ros.progress import Point, Progress
from marsupial_ros.settings import RobotSettings
from marsupial_ros.transforms import Frames, Transform

# how far a robot may have come along its route since the last look: a route may pass a place twice
LOOK_AHEAD_M = 5.0


@dataclass(slots=True)
class Errand:
    """A command that has not ended: ROS was asked for `goal` at `since_s`, by a `name` that no other goal has.

    Of a drive, `passed` is the point of its route where the robot is or was last, `progress` the progress since then.
    `cancelled_s` is when the goal was last cancelled, None if it was not.
    """

    command: Command
    goal: ActionGoal | None = None
    name: str = ""
    attempt: int = 0
    passed: int = 0
    since_s: float = 0.0
    progress: Progress = field(default_factory=Progress)
    cancelled_s: float | None = None

    @property
    def drives(self) -> bool:
        """Whether it is a drive."""
        return self.command["name"] == "drive"

    @property
    def route_m(self) -> list[Point]:
        """Of a drive: its points in metres of the map frame."""
        return [(x, y) for x, y in self.command["route_m"]]

    def pass_by(self, at: Point, tolerance_m: float) -> Point | None:
        """Return the point of the route that a robot is at, and remember it; None if it is off the route."""
        route, gone = self.route_m, 0.0
        best, least = self.passed, math.inf
        for i in range(self.passed, len(route)):  # never back, though a route may pass a place twice
            gone += math.dist(route[i - 1], route[i]) if i > self.passed else 0.0
            if gone > LOOK_AHEAD_M:
                break
            if math.dist(route[i], at) < least:
                best, least = i, math.dist(route[i], at)
        if least > tolerance_m:
            return None
        self.passed = best
        return route[best]


@dataclass(slots=True)
class TrackedRobot:
    """A robot, and what is known of it.

    `anchor` is its reported place in metres of the map frame. It is `silent` once the user was told so.
    """

    settings: RobotSettings
    frames: Frames
    aboard: str | None
    anchor: Point | None = None
    errand: Errand | None = None
    silent: bool = False
    lost: bool = False
    since_s: float = 0.0

    @property
    def name(self) -> str:
        """Its name in the mission."""
        return self.settings.name

    @property
    def on_ground(self) -> bool:
        """Whether it stands or drives by itself."""
        return self.aboard is None and not self.lost

    def pose(self, map_frame: str) -> Transform | None:
        """Return where it is on the map, None as long as tf doesn't connect the two."""
        found = self.frames.find(self.settings.base_frame, map_frame)
        return None if found is None else found[0]

    def point(self, map_frame: str) -> Point | None:
        """Return where it is on the map in metres."""
        pose = self.pose(map_frame)
        return None if pose is None else (pose.x, pose.y)

    def silent_for(self, map_frame: str, now_s: float) -> float:
        """Return for how many seconds nothing was heard of where it is, while there was somebody to tell."""
        found = self.frames.find(self.settings.base_frame, map_frame)
        if found is None:
            return now_s - self.since_s
        return 0.0 if found[1] is None else now_s - max(found[1], self.since_s)
