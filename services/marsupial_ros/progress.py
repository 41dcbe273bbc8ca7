"""Whether a drive gets on: one meaning for what tf and the drive's action tell.

A robot that gets on moves, and less is left of its way than ever was: one that backs up and comes on again, or turns
on the spot, moves but is no nearer. Where the action doesn't tell what is left, moves alone count.

References: nav2's `FollowPath` (`distance_to_goal`) and `NavigateToPose` (`distance_remaining`,
`number_of_recoveries`). The latter tells 0 m as long as there is no path, and at first what is left of the path
before; a new path may be longer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Point = tuple[float, float]

# a robot that moves, or gets nearer, by less than this stands still
PROGRESS_M = 0.1
# a route that is longer by this much is a new one: the robot has to get nearer on that
DETOUR_M = 1.0
# older feedback is ignored
FEEDBACK_S = 5.0
# recoveries in a row that bring a robot no nearer; nav2's own behavior tree gives up after as many failures
MOST_RECOVERIES = 6


@dataclass(slots=True)
class Progress:
    """What is known of a drive's progress.

    The robot was last seen to move at `moved_s` from `moved_from`. Its action last told at `told_s` what is left; on
    the present way the least was `left_m`, at `nearer_s`, on any way `least_m`. `recoveries` are their number at the
    time of that and by now.
    """

    moved_s: float = 0.0
    moved_from: Point | None = None
    told_s: float = -math.inf
    nearer_s: float = 0.0
    left_m: float = math.inf
    least_m: float = math.inf
    recoveries: tuple[int, int] | None = None

    def see(self, at: Point, now_s: float) -> None:
        """Apply the robot's position."""
        if self.moved_from is None or math.dist(at, self.moved_from) > PROGRESS_M:
            self.moved_from, self.moved_s = at, now_s

    def hear(self, feedback: Mapping[str, Any], now_s: float) -> None:
        """Apply feedback of the action; missing fields and invalid numbers are ignored."""
        recoveries = _number(feedback.get("number_of_recoveries"))
        if recoveries is not None:
            then = recoveries if self.recoveries is None else min(recoveries, self.recoveries[0])
            self.recoveries = int(then), int(recoveries)
        left_m = _number(feedback.get("distance_remaining", feedback.get("distance_to_goal")))
        if left_m:
            self._approach(left_m, now_s)

    def stood_for(self, now_s: float) -> float:
        """Return for how many seconds the robot has stood, 0 if it was not seen yet."""
        return 0.0 if self.moved_from is None else now_s - self.moved_s

    def fault(self, now_s: float, stuck_s: float) -> str | None:
        """Say why the robot is stuck, None if it gets on."""
        told = now_s - self.told_s <= FEEDBACK_S
        if max(self.stood_for(now_s), now_s - self.nearer_s if told else 0.0) > stuck_s:
            return f"no progress for {stuck_s:g} s"
        then, now = self.recoveries or (0, 0)
        return f"{now - then} recoveries without progress" if now - then >= MOST_RECOVERIES else None

    def _approach(self, left_m: float, now_s: float) -> None:
        if now_s - self.told_s > FEEDBACK_S or left_m < self.left_m - PROGRESS_M:
            self.left_m, self.nearer_s = left_m, now_s
        elif left_m > self.left_m + DETOUR_M:
            self.left_m = left_m
        self.told_s = now_s
        if left_m < self.least_m - PROGRESS_M:
            self.least_m = left_m
            if self.recoveries is not None:
                self.recoveries = self.recoveries[1], self.recoveries[1]


def _number(value: object) -> float | None:
    """Return a distance or a count; None for what is none."""
    found = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and value >= 0
    return float(value) if found else None  # type: ignore[arg-type]
