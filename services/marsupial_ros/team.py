"""The team in ROS: where its robots are, and what the next report says of them."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import cast

from marsupial_client.mission_documents import Failed, Lost, News, RobotNote
from marsupial_ros.goals import actions_of
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.robots import ActiveCommand, TrackedRobot
from marsupial_ros.settings import Settings
from marsupial_ros.transforms import Frames, Point


@dataclass(slots=True)
class UnreportedEvents:
    """What has happened since the last report."""

    finished: list[int] = field(default_factory=list)
    failed: list[Failed] = field(default_factory=list)
    lost: list[Lost] = field(default_factory=list)
    declined: list[Failed] = field(default_factory=list)
    returned: list[str] = field(default_factory=list)
    contact: list[str] = field(default_factory=list)  # rovers that are out of contact now, or in contact again

    @property
    def any(self) -> bool:
        """Whether anything has happened."""
        return any(asdict(self).values())


class Team:
    """The robots of a mission; `frames` has their transforms by topic, `say` shows the user a line.

    `unreported` goes into the next report.
    """

    def __init__(
        self,
        settings: Settings,
        frames: Mapping[str, Frames],
        tracker: MapTracker,
        say: Callable[[str], None],
    ) -> None:
        self._settings = settings
        self._waits = settings.waits
        self._tracker = tracker
        self._say = say
        self.unreported = UnreportedEvents()
        frame = settings.map.frame
        self.robots = {one.name: TrackedRobot(one, frames[one.tf], frame, one.carrier) for one in settings.robots}

    @property
    def active_commands(self) -> list[ActiveCommand]:
        """The commands that have not ended."""
        # both robots of a docking have the same command: count it once, by identity
        found = {id(robot.active): robot.active for robot in self.robots.values() if robot.active is not None}
        return list(found.values())

    @property
    def actions(self) -> dict[str, str]:
        """All actions that the team may be sent goals for, and their types."""
        return actions_of([robot.settings for robot in self.robots.values()])

    @property
    def goals(self) -> list[ActiveCommand]:
        """The commands whose goals have not ended."""
        return [active for active in self.active_commands if active.goal is not None]

    @property
    def driving(self) -> bool:
        """Whether any robot in contact is driving."""
        return any(active.drives and not self._is_away(active) for active in self.active_commands)

    def missing_poses(self, now_s: float, away: Collection[str] = ()) -> list[str]:
        """Return the robots on the ground that tf does not place on the map yet, and the transform each lacks.

        Those `away` are known to be out of contact.
        """
        found = []
        for robot in self.robots.values():
            if robot.name in away:
                continue
            if robot.on_ground and not robot.has_place(now_s, self._waits.silent_s):
                found.append(f"{robot.name} ({robot.lacks})")
        return found

    def off_map(self) -> list[str]:
        """Return the robots on the ground that the last map does not contain."""
        places = {robot.name: robot.point for robot in self.robots.values() if robot.on_ground}
        return [name for name, at in places.items() if at is not None and not self._tracker.contains(at)]

    def place(self) -> None:
        """Place robots on the ground where tf has them, or on the nearest free ground."""
        for robot in self.robots.values():
            if robot.on_ground and robot.anchor is None:
                robot.anchor = self._standing_point(robot)

    def resume(self, aboard: Mapping[str, str], lost: Collection[str], unreported: UnreportedEvents) -> None:
        """Restore the team: each rover's carrier, the lost robots, and the events still to report."""
        self.unreported = unreported
        for robot in self.robots.values():
            robot.aboard, robot.lost = aboard.get(robot.name), robot.name in lost

    def part(self, names: Iterable[str], now_s: float) -> None:
        """Note that rovers are out of contact."""
        for name in names:
            self.robots[name].away_s = now_s

    def report(self) -> News:
        """Return where the robots are and what has happened since the last call."""
        events, self.unreported = self.unreported, UnreportedEvents()
        if events.lost:  # a robot returns after its loss is reported
            events.returned, self.unreported.returned = [], events.returned
        if events.lost and events.finished:
            # the service accepts no ends from a lost robot: report what it finished first
            events.lost, self.unreported.lost = [], events.lost
        events.returned = [one for name in events.returned for one in self._take_back(name)]
        lists = asdict(events)
        contact = lists.pop("contact")
        lists["out_of_contact"] = [{"robot": name} for name in contact if self.robots[name].away_s is not None]
        lists["in_contact"] = [name for name in contact if self.robots[name].away_s is None]
        # the others have the names that they have in reports
        return cast(News, {"t_ms": 0, "robots": self.notes(), **{key: some for key, some in lists.items() if some}})

    def notes(self) -> list[RobotNote]:
        """Return where the robots on the ground are (driving ones: on their routes), and charges that are new."""
        found: dict[str, RobotNote] = {}
        for robot in self._standing_or_driving():
            self._update_anchor(robot)
            # a map may leave out robots: the mission then knows no place where they are
            if robot.anchor is not None and self._tracker.in_frame(robot.anchor):
                found[robot.name] = {"name": robot.name, "pose_m": list(robot.anchor)}
            if robot.anchor is not None and robot.speed is not None:
                found.setdefault(robot.name, {"name": robot.name})["speed_share"] = robot.speed
        for name, robot in self.robots.items():
            if robot.charge is not None and not robot.lost:
                found.setdefault(name, {"name": name})["charge"] = robot.charge
            robot.charge = None  # reported once: a topic may go silent, and then the mission estimates
        return list(found.values())

    def points(self) -> dict[str, Point]:
        """Return where the robots on the ground are, in metres of the map frame."""
        places = {robot.name: robot.point or robot.anchor for robot in self._standing_or_driving()}
        return {name: point for name, point in places.items() if point is not None}

    def _standing_or_driving(self) -> Iterator[TrackedRobot]:
        """Yield the robots that stand or drive by themselves: all on the ground but docking and undocking rovers."""
        for robot in self.robots.values():
            active = robot.active
            if robot.on_ground and (active is None or active.drives or active.command["robot"] != robot.name):
                yield robot

    def _update_anchor(self, robot: TrackedRobot) -> None:
        """Update the reported place of a robot; one that isn't driving has to be off it by more than the tolerance."""
        at = robot.point
        if at is None:
            return
        if robot.active is not None and robot.active.drives:
            robot.anchor = robot.active.advance(at, self._waits.tolerance_m) or self._standing_point(robot)
        elif robot.anchor is None or math.dist(at, robot.anchor) > self._waits.tolerance_m:
            robot.anchor = self._standing_point(robot)

    def _standing_point(self, robot: TrackedRobot) -> Point | None:
        at = robot.point
        if at is None:
            return robot.anchor
        return self._tracker.standing(robot.settings.kind, at, self._waits.tolerance_m) or at

    def _is_away(self, active: ActiveCommand) -> bool:
        """Return whether the robot of a command is out of contact."""
        return self.robots[active.command["robot"]].away_s is not None

    def _participants(self, active: ActiveCommand) -> list[TrackedRobot]:
        command = active.command
        names = [command["robot"]] if active.drives else [command["robot"], command["carrier"]]
        return [self.robots[name] for name in names]

    def _take_back(self, name: str) -> list[str]:
        """Let a lost robot act again, with the rovers aboard it; return them."""
        found = [one for one in self.robots.values() if one.lost and name in (one.name, one.aboard)]
        for robot in found:
            robot.lost, robot.silent, robot.lost_s = False, False, None
            if robot.on_ground:
                robot.anchor = self._standing_point(robot)
        return [robot.name for robot in found]
