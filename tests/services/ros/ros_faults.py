"""What goes wrong with a real ROS 2 behind rosbridge, for `fake_ros`; and the messages of both.

rosbridge shares a subscription among its clients by the literal name of the topic: only the first of them gets all
latched messages. It subscribes reliably where it finds no publisher, and then never hears one of best effort. Goals
that no action server takes end with ``result: false``. It sends no ``status`` messages.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

Message = dict[str, Any]


@dataclass
class Faults:
    """Faults that are present now; action servers and topics by their absolute names.

    Goals for `absent` action servers and `rejecting` ones are not taken, those for `failing` ones are aborted;
    `answers`: whether rosbridge says so, as 2.1 does not. Without `rosapi`, nobody knows which action servers exist.
    Topics in `late` have no publisher yet, and one of best effort later. `held` are the literal names that another
    client has subscribed to. Maps come every `map_steps` steps, unless the mapper has `stalled`. Messages longer than
    `limit` bytes close the connection. The next `ignored_cancels` cancel requests are ignored.
    """

    absent: set[str] = field(default_factory=set)
    rejecting: set[str] = field(default_factory=set)
    failing: set[str] = field(default_factory=set)
    answers: bool = True
    rosapi: bool = True
    late: set[str] = field(default_factory=set)
    held: set[str] = field(default_factory=set)
    map_steps: int = 10
    stalled: bool = False
    limit: int | None = None
    ignored_cancels: int = 0

    def refusal(self, action: str) -> str | None:
        """Return why no action server takes a goal."""
        if action in self.absent:
            return "No action server available"
        return "Action goal was rejected" if action in self.rejecting else None


def absolute(topic: str) -> str:
    """Return the name that rosbridge, in the root namespace, resolves a literal name to."""
    return f"/{topic.lstrip('/')}"


def xyz(x: float, y: float) -> Message:
    return {"x": x, "y": y, "z": 0.0}


def turned(yaw: float) -> Message:
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}


def time_of(now_s: float) -> Message:
    return {"sec": int(now_s), "nanosec": int(now_s % 1 * 1e9)}


def link_of(parent: str, child: str, at: tuple[float, float], yaw: float, stamp_s: float) -> Message:
    transform = {"translation": xyz(*at), "rotation": turned(yaw)}
    return {"header": {"frame_id": parent, "stamp": time_of(stamp_s)}, "child_frame_id": child, "transform": transform}
