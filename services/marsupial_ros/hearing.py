"""What comes from ROS, taken in: maps, updates, transforms and time; feedback and ends of goals go to the fleet."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from marsupial_ros.chart import Chart
from marsupial_ros.clock import Clock
from marsupial_ros.fleet import RobotFleet
from marsupial_ros.messages import (
    CLOCK_TYPE,
    MAP_TYPE,
    TF_TYPE,
    UNREADABLE,
    UPDATE_TYPE,
    check_frame,
    link_in,
    occupancy_in,
    seconds_of,
    update_in,
)
from marsupial_ros.rosbridge import ActionResult, Subscription
from marsupial_ros.settings import Settings
from marsupial_ros.transforms import Frames

STATIC = "_static"

Reader = Callable[[Mapping[str, Any]], None]


def subscriptions(settings: Settings) -> list[Subscription]:
    """Return what is to be heard. Transforms are never thinned out: the one left out could be any robot's."""
    one = settings.map
    found = [
        Subscription(one.topic, MAP_TYPE, one.compression.value),
        Subscription(one.updates, UPDATE_TYPE, one.compression.value),
    ]
    for topic in dict.fromkeys(robot.tf for robot in settings.robots):
        found += [Subscription(topic, TF_TYPE), Subscription(topic + STATIC, TF_TYPE)]
    return found if settings.clock is None else [*found, Subscription(settings.clock, CLOCK_TYPE)]


class Hearing:
    """Receives messages of rosbridge; unreadable ones are reported once per topic and ignored."""

    def __init__(
        self, settings: Settings, frames: Mapping[str, Frames], chart: Chart, clock: Clock, say: Callable[[str], None]
    ) -> None:
        self._frame = settings.map.frame
        self._chart = chart
        self._clock = clock
        self._say = say
        self._said: set[str] = set()
        self._open = False
        self.fleet: RobotFleet | None = None
        self._readers: dict[str, Reader] = {settings.map.topic: self._map, settings.map.updates: self._update}
        for topic, known in frames.items():
            self._readers[topic] = partial(self._transforms, known, False)
            self._readers[topic + STATIC] = partial(self._transforms, known, True)
        if settings.clock is not None:
            self._readers[settings.clock] = lambda message: clock.tell(seconds_of(message["clock"]))

    def connected(self) -> None:
        self._say("rosbridge: connected")
        self._open = True
        self._said.clear()
        if self.fleet is not None:
            self.fleet.connected(self._clock.now_s)

    def disconnected(self, reason: str) -> None:
        """Tell that the connection is gone, and once only that there is none."""
        self._once("connection", f"rosbridge: {'connection lost' if self._open else 'no connection'}: {reason}")
        self._open = False

    def message(self, topic: str, message: Mapping[str, Any]) -> None:
        try:
            self._readers[topic](message)
        except UNREADABLE as error:
            self._once(topic, f"{topic}: a message was passed over: {error}")

    def feedback(self, goal: str, values: Mapping[str, Any]) -> None:
        if self.fleet is not None:
            self.fleet.hear(goal, values, self._clock.now_s)

    def ended(self, end: ActionResult) -> None:
        if self.fleet is not None:
            self.fleet.ended(end)

    def complaint(self, text: str) -> None:
        self._once(text, text)

    def _map(self, message: Mapping[str, Any]) -> None:
        check_frame(message, self._frame)
        self._chart.take(occupancy_in(message))

    def _update(self, message: Mapping[str, Any]) -> None:
        check_frame(message, self._frame)
        self._chart.update(update_in(message))

    def _transforms(self, frames: Frames, static: bool, message: Mapping[str, Any]) -> None:
        """Store all readable links: the unreadable ones may be of other robots."""
        faults: list[Exception] = []
        for stamped in message["transforms"]:
            try:
                link = link_in(stamped)
            except UNREADABLE as error:
                faults.append(error)
                continue
            at_s = None if static else self._clock.heard_s(link.stamp_s)
            frames.tell(link.parent, link.child, link.transform, at_s, link.stamp_s)
        if faults:
            raise faults[0]

    def _once(self, key: str, text: str) -> None:
        if key not in self._said:
            self._said.add(key)
            self._say(text)
