"""Receive ROS messages: store maps, updates, transforms and time; pass feedback and ends of goals to the fleet."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from marsupial.formats.mapfiles.occupancy import Occupancy
from marsupial_ros.fleet import RobotFleet
from marsupial_ros.map_merger import MapMerger
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.messages import (
    BATTERY_TYPE,
    CLOCK_TYPE,
    MAP_TYPE,
    SPEED_TYPE,
    TF_TYPE,
    UNREADABLE,
    UPDATE_TYPE,
    charge_in,
    check_frame,
    frame_in,
    link_in,
    occupancy_in,
    seconds_of,
    speed_share_in,
    stamp_in,
    update_in,
)
from marsupial_ros.robots import TrackedRobot
from marsupial_ros.settings import Settings
from marsupial_ros.transforms import Frames
from marsupial_ros.transport import STATIC, ActionResult, Subscription

MessageReader = Callable[[Mapping[str, Any]], None]


class Clock:
    """Monotonic seconds, and mission time in ms: by this machine or, if `simulated`, by messages (``/clock``)."""

    def __init__(self, *, simulated: bool) -> None:
        self._time_s: float | None = None
        self._simulated = simulated
        self._began_s = 0.0
        self._began_ms = 0

    @property
    def known(self) -> bool:
        return not self._simulated or self._time_s is not None

    @property
    def now_s(self) -> float:
        """The time in seconds since an arbitrary moment."""
        return (self._time_s or 0.0) if self._simulated else time.monotonic()

    @property
    def mission_ms(self) -> int:
        return self._began_ms + max(0, round(1000 * (self.now_s - self._began_s)))

    def received_s(self, stamp_s: float) -> float:
        """Return the time of a message that has just arrived, given its stamp (0: none)."""
        # stamps are by another machine's clock, except with simulated time: then they show the age of a message
        return min(stamp_s, self.now_s) if self._simulated and stamp_s else self.now_s

    def set(self, now_s: float) -> None:
        """Set the time. After a simulator reset, the clock stands still until simulated time catches up."""
        self._time_s = now_s if self._time_s is None else max(now_s, self._time_s)

    def begin(self, at_ms: int = 0) -> None:
        self._began_s, self._began_ms = self.now_s, at_ms


def subscriptions(settings: Settings) -> list[Subscription]:
    """Return the subscriptions. Transforms are not throttled: the dropped message could be any robot's."""
    one = settings.map
    found = []
    for topic, updates in one.topics.items():
        found.append(Subscription(topic, MAP_TYPE, one.compression.value))
        found.append(Subscription(updates, UPDATE_TYPE, one.compression.value))
    for topic in dict.fromkeys(robot.tf for robot in settings.robots):
        found += [Subscription(topic, TF_TYPE), Subscription(topic + STATIC, TF_TYPE)]
    limits = dict.fromkeys(robot.speed_limit for robot in settings.robots if robot.speed_limit is not None)
    found += [Subscription(topic, SPEED_TYPE) for topic in limits]
    batteries = (robot.battery for robot in settings.robots if robot.battery is not None)
    found += [Subscription(topic, BATTERY_TYPE) for topic in batteries]
    return found if settings.clock is None else [*found, Subscription(settings.clock, CLOCK_TYPE)]


class RosListener:
    """Receives messages from the transport of that name; unreadable ones are reported once per topic and ignored."""

    def __init__(
        self,
        settings: Settings,
        frames: Mapping[str, Frames],
        tracker: MapTracker,
        clock: Clock,
        fleet: RobotFleet,
        say: Callable[[str], None],
        name: str,
    ) -> None:
        self._name = name
        self._frame = settings.map.frame
        self._tracker = tracker
        self._clock = clock
        self._fleet = fleet
        self._say = say
        topics = settings.map.topics
        self._maps = {*topics, *topics.values()}
        self._merger = MapMerger(settings.map.frame, frames.values()) if len(topics) > 1 else None
        self._ignored: dict[str, str] = {}  # why maps and updates are ignored now, by topic
        self._said: set[str] = set()
        self._open = False
        self._readers: dict[str, MessageReader] = {topic: partial(self._map, topic) for topic in topics}
        self._readers |= {updates: partial(self._update, topic) for topic, updates in topics.items()}
        for topic, known in frames.items():
            self._readers[topic] = partial(self._transforms, known, False)
            self._readers[topic + STATIC] = partial(self._transforms, known, True)
        for robot in fleet.robots.values():
            if robot.settings.speed_limit is not None:
                self._readers[robot.settings.speed_limit] = partial(self._speed_limit, robot.settings.speed_limit)
            if robot.settings.battery is not None:
                self._readers[robot.settings.battery] = partial(self._battery, robot)
        if settings.clock is not None:
            self._readers[settings.clock] = lambda message: clock.set(seconds_of(message["clock"]))

    def connected(self) -> None:
        self._say(f"{self._name}: connected")
        self._open = True
        self._said.clear()
        self._fleet.connected(self._clock.now_s)

    def disconnected(self, reason: str) -> None:
        """Tell the user that the connection is lost, or, only once, that it can't be opened."""
        self._once("connection", f"{self._name}: {'connection lost' if self._open else 'no connection'}: {reason}")
        self._open = False

    def message(self, topic: str, message: Mapping[str, Any]) -> None:
        try:
            self._readers[topic](message)
        except UNREADABLE as error:
            text = f"{topic}: message ignored: {error}"
            if topic in self._maps and self._ignored.get(topic) != text:
                self._ignored[topic] = text
                self._once(text, text)
            elif topic not in self._maps:
                self._once(topic, text)
        else:
            if self._ignored.pop(topic, None) is not None:
                self._once(f"{topic}: accepted", f"{topic}: messages are used again")

    def feedback(self, goal: str, values: Mapping[str, Any]) -> None:
        self._fleet.apply_feedback(goal, values, self._clock.now_s)

    def ended(self, end: ActionResult) -> None:
        self._fleet.ended(end)

    def warning(self, text: str) -> None:
        self._once(text, text)

    def _map(self, topic: str, message: Mapping[str, Any]) -> None:
        occupancy, made_s = occupancy_in(message), self._clock.received_s(stamp_in(message))
        if self._merger is None:
            check_frame(message, self._frame)
            self._tracker.take(occupancy)
            self._tracker.date(made_s)
        else:
            self._take_whole(self._merger.take(topic, frame_in(message) or self._frame, occupancy, made_s))
        for text in occupancy.warnings():
            self._once(text, text)

    def _update(self, topic: str, message: Mapping[str, Any]) -> None:
        made_s = self._clock.received_s(stamp_in(message))
        if self._merger is None:
            check_frame(message, self._frame)
            self._tracker.update(update_in(message))
            self._tracker.date(made_s)
        elif (whole := self._merger.update(topic, update_in(message), made_s)) is not None:
            self._take_whole(whole)

    def _take_whole(self, whole: Occupancy) -> None:
        """Take a map that is merged of several: it is as old as the oldest of them."""
        assert self._merger is not None
        self._tracker.take(whole)
        # the first map of each robot must not look like a second one of the same
        if self._merger.made_s > self._tracker.made_s:
            self._tracker.date(self._merger.made_s)

    def _speed_limit(self, topic: str, message: Mapping[str, Any]) -> None:
        for robot in self._fleet.robots.values():
            if robot.settings.speed_limit == topic:
                robot.speed = speed_share_in(message, robot.settings.kind.speed_mps)

    def _battery(self, robot: TrackedRobot, message: Mapping[str, Any]) -> None:
        robot.charge = charge_in(message)
        if robot.charge is None:
            text = f"{robot.settings.battery}: the charge of {robot.name} is unknown: it is estimated"
            self._once(text, text)

    def _transforms(self, frames: Frames, static: bool, message: Mapping[str, Any]) -> None:
        """Store all readable links: unreadable ones may belong to other robots."""
        faults: list[Exception] = []
        for stamped in message["transforms"]:
            try:
                parent, child, transform, stamp_s = link_in(stamped)
            except UNREADABLE as error:
                faults.append(error)
                continue
            at_s = None if static else self._clock.received_s(stamp_s)
            frames.add(parent, child, transform, at_s, stamp_s)
        if faults:
            raise faults[0]

    def _once(self, key: str, text: str) -> None:
        if key not in self._said:
            self._said.add(key)
            self._say(text)
