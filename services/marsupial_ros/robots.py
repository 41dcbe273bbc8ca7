"""One robot of the team: its position by tf, the command it carries out, and whether a drive makes progress.

A drive makes progress if the robot moves and its remaining route is shorter than ever before: a robot that backs up
and returns, or turns on the spot, gets no nearer. If the action reports no remaining distance, movement is enough.

References: nav2's `FollowPath` (`distance_to_goal`) and `NavigateToPose` (`distance_remaining`,
`number_of_recoveries`). `NavigateToPose` reports 0 m while it has no path, and at first the remaining distance of the
previous path; a new path may be longer.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from marsupial_client.mission_documents import Command
from marsupial_ros.goals import ActionGoal
from marsupial_ros.settings import RobotSettings
from marsupial_ros.transforms import Frames, Point, Transform
from marsupial_ros.transport import Refusal

# a robot that moves, or gets nearer, by less than this counts as standing still
PROGRESS_M = 0.1
# a remaining distance that grew by this much means a new route, on which the robot has to get nearer
DETOUR_M = 1.0
# older feedback is ignored
FEEDBACK_S = 5.0
# recoveries in a row without getting nearer; nav2's own behavior tree gives up after as many failures
MOST_RECOVERIES = 6
# a robot that somebody else has driven is left alone until it has stood still for this long
IDLE_S = 5.0
# how far ahead on its route to look for a robot: a route may pass a place twice
LOOK_AHEAD_M = 5.0


@dataclass(slots=True)
class Progress:
    """What is known of a drive's progress.

    The robot was last seen to move at `moved_s` from `moved_from`. Its action last reported the remaining distance at
    `feedback_s`; the least on the current route was `left_m`, at `nearer_s`; on any route, `least_m`. `recoveries` are
    their numbers then and now.
    """

    moved_s: float = 0.0
    moved_from: Point | None = None
    feedback_s: float = -math.inf
    nearer_s: float = 0.0
    left_m: float = math.inf
    least_m: float = math.inf
    recoveries: tuple[int, int] | None = None

    def apply_position(self, at: Point, now_s: float) -> None:
        if self.moved_from is None or math.dist(at, self.moved_from) > PROGRESS_M:
            self.moved_from, self.moved_s = at, now_s

    def apply_feedback(self, feedback: Mapping[str, Any], now_s: float) -> None:
        """Apply feedback of the action; missing fields and invalid numbers are ignored."""
        recoveries = _number(feedback.get("number_of_recoveries"))
        if recoveries is not None:
            then = recoveries if self.recoveries is None else min(recoveries, self.recoveries[0])
            self.recoveries = int(then), int(recoveries)
        left_m = _number(feedback.get("distance_remaining", feedback.get("distance_to_goal")))
        if left_m:
            self._approach(left_m, now_s)

    def standing_s(self, now_s: float) -> float:
        """Return for how many seconds the robot has stood still; 0 if it has not been seen yet."""
        return 0.0 if self.moved_from is None else now_s - self.moved_s

    def fault(self, now_s: float, stuck_s: float) -> str | None:
        """Return why the robot is stuck, None if it makes progress."""
        has_feedback = now_s - self.feedback_s <= FEEDBACK_S
        if max(self.standing_s(now_s), now_s - self.nearer_s if has_feedback else 0.0) > stuck_s:
            return f"no progress for {stuck_s:g} s"
        then, now = self.recoveries or (0, 0)
        return f"{now - then} recoveries without progress" if now - then >= MOST_RECOVERIES else None

    def _approach(self, left_m: float, now_s: float) -> None:
        if now_s - self.feedback_s > FEEDBACK_S or left_m < self.left_m - PROGRESS_M:
            self.left_m, self.nearer_s = left_m, now_s
        elif left_m > self.left_m + DETOUR_M:
            self.left_m = left_m
        self.feedback_s = now_s
        if left_m < self.least_m - PROGRESS_M:
            self.least_m = left_m
            if self.recoveries is not None:
                self.recoveries = self.recoveries[1], self.recoveries[1]


@dataclass(slots=True)
class Takeover:
    """Somebody else leads the robot: `surely`, or perhaps, as its goal ended without a reason.

    nav2 ends a goal that another one replaces as aborted, with error 0. Before Jazzy it gives no errors at all, so only
    a robot that drives on tells a takeover from a failure.
    """

    surely: bool
    progress: Progress = field(default_factory=Progress)

    def idle(self, at: Point, now_s: float) -> bool:
        """Note where the robot is, and return whether it is left alone no more."""
        before = self.progress.moved_from
        self.progress.apply_position(at, now_s)
        self.surely = self.surely or before not in (None, self.progress.moved_from)
        return self.progress.standing_s(now_s) > IDLE_S


@dataclass(slots=True)
class ActiveCommand:
    """A command that has not ended: its `goal` was sent to ROS at `since_s` under the unique `name`.

    Without a `goal` it waits to be sent (again), after `refusals` since `waits_s`, the last one for `refusal`. With
    a reason in `replaced` it waits to learn whether somebody else has replaced its goal. From `arrived_s` on (inf: just
    now) its robot waits for a map that shows what it sees there.
    For a drive, `passed` is the point of its route where the robot is or was last, `progress` the progress since then,
    and it is `answered` once the goal has feedback.
    `cancelled_s` is when the goal was last cancelled, None if it was not cancelled.
    """

    command: Command
    goal: ActionGoal | None = None
    name: str = ""
    attempt: int = 0
    passed: int = 0
    since_s: float = 0.0
    progress: Progress = field(default_factory=Progress)
    answered: bool = False
    cancelled_s: float | None = None
    refusals: int = 0
    refusal: Refusal | None = None
    waits_s: float = 0.0
    replaced: str = ""
    arrived_s: float | None = None

    @property
    def drives(self) -> bool:
        return self.command["name"] == "drive"

    @property
    def begun(self) -> bool:
        """Whether there is a sign that a drive has begun."""
        return self.passed > 0 or self.answered

    @property
    def route_m(self) -> list[Point]:
        """The points of a drive's route, in metres of the map frame."""
        return [(x, y) for x, y in self.command["route_m"]]

    def advance(self, at: Point, tolerance_m: float) -> Point | None:
        """Return the route point the robot is at, and remember it; None if the robot is off the route."""
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
    """A robot and its state.

    `anchor` is its reported place in metres of the `map_frame`. `silent` means the user knows that transforms stopped.
    It is `refusing` while the user knows that its action server accepts no goals. The service has counted it as lost
    `losses` times, last at `lost_s` (None: it is not).
    `speed` is the share of its full speed that its speed limit allows, None before it has one. `charge` is the latest
    state of charge of its battery, None if there is none since the last report. It is out of contact since `away_s`.
    """

    settings: RobotSettings
    frames: Frames
    map_frame: str
    aboard: str | None
    anchor: Point | None = None
    active: ActiveCommand | None = None
    silent: bool = False
    lost: bool = False
    since_s: float = 0.0
    speed: float | None = None
    charge: float | None = None
    away_s: float | None = None
    refusing: bool = False
    losses: int = 0
    lost_s: float | None = None
    taken: Takeover | None = None

    @property
    def name(self) -> str:
        return self.settings.name

    @property
    def on_ground(self) -> bool:
        """Whether the robot is neither aboard a carrier nor lost."""
        return self.aboard is None and not self.lost

    @property
    def pose(self) -> Transform | None:
        """The robot's pose on the map, None while tf doesn't connect the two frames."""
        found = self._find()
        return None if found is None else found[0]

    @property
    def point(self) -> Point | None:
        """The robot's position on the map in metres, None while it is unknown."""
        pose = self.pose
        return None if pose is None else pose.point

    @property
    def lacks(self) -> str:
        """Which transform is missing, or gets no newer."""
        base, tf = self.settings.base_frame, self.settings.tf
        gap = self.frames.gap(base, self.map_frame)
        if gap is None:
            return f"no new {self.map_frame} -> {base} on {tf}"
        return f"no {self.map_frame} -> {base} on {tf}: nothing there or on {tf}_static places {gap} in another frame"

    def silence_s(self, now_s: float) -> float:
        """Return the seconds since the robot's pose was last updated, counting from `since_s` at the earliest."""
        found = self._find()
        if found is None:
            return now_s - self.since_s
        return 0.0 if found[1] is None else now_s - max(found[1], self.since_s)

    def has_place(self, now_s: float, silent_s: float) -> bool:
        """Return whether its place is known, and no older than `silent_s`."""
        return self.pose is not None and self.silence_s(now_s) <= silent_s

    def heard_since(self, then_s: float) -> bool:
        """Return whether the robot's pose was updated after a moment."""
        found = self._find()
        return found is not None and (found[1] is None or found[1] > then_s)

    def _find(self) -> tuple[Transform, float | None] | None:
        return self.frames.find(self.settings.base_frame, self.map_frame)


def _number(value: object) -> float | None:
    """Return a distance or a count; None if the value is neither."""
    found = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and value >= 0
    return float(value) if found else None  # type: ignore[arg-type]
