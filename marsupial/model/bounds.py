"""Bounds of all quantities that come from outside: one table for files, options and requests.

Readers of scenarios and situations check against it. The service's request models do so too, and show the bounds in the
OpenAPI document.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from marsupial.errors import Problem

MOST = 1e15  # largest number of metres, seconds or cells that any input may contain
LONGEST_MS = 10**12  # longest duration, about 30 years: sums over thousands of such actions don't overflow
LONGEST_NAME = 100  # most characters in the name of a robot, a robot type or a terrain
LONGEST_TEXT = 200  # most characters in any other name: of a mission, a planner, a place
MOST_ROBOTS = 1000  # most robots in a team, carriers and rovers
_LONGEST_S = 10_000_000  # about four months: the longest docking, and the longest mission


@dataclass(frozen=True, slots=True)
class Bound:
    """The least and the greatest allowed number, in `unit`; with `above`, the least itself is excluded."""

    least: float
    most: float
    unit: str = ""
    above: bool = False

    def fault(self, value: float) -> str | None:
        """Return what is wrong with a number, or None if it is within the bound."""
        if isinstance(value, float) and not math.isfinite(value):
            return f"must be finite, got {value}"
        # "must be positive" reads better than "must be 0.001 or more"
        if value <= 0 and (self.above or 0 < self.least < 1):
            return f"must be positive, got {value}"
        if value < self.least:
            return f"must be {self.least} or more, got {value}"
        if value > self.most:
            return f"must be at most {self.most}, got {value}"
        return None


# what a comparison has if nothing else is asked for: missions per case and contender, steps per planning call
COMPARE_RUNS, COMPARE_STEPS = 30, 8

BOUNDS: Mapping[str, Bound] = {
    # maps
    "resolution_m": Bound(0.001, 1000, "m"),
    "extent_m": Bound(0, MOST, "m", above=True),
    "coordinate_m": Bound(-MOST, MOST, "m"),
    "side": Bound(1, 10**6, "cells"),
    "cell": Bound(0, 10**9, "cells"),
    "terrain_code": Bound(3, 254),
    "grey": Bound(0, 255),
    "share": Bound(0, 1),
    "coverage": Bound(0, 1, above=True),
    "least_ground": Bound(0, 100, "footprints"),
    "speed_share": Bound(0.01, 2),
    "zone_weight": Bound(1, 1000),
    "rate_per_h": Bound(0, 1000, "faults an hour", above=True),
    # robot types
    "speed_mps": Bound(0.001, 1000, "m/s"),
    "sensor_range_m": Bound(0, 10_000, "m", above=True),
    "radio_range_m": Bound(0, 100_000, "m", above=True),
    "sensor_angle_deg": Bound(1, 360, "degrees"),
    "radius_m": Bound(0, 100, "m"),
    "power_w": Bound(0, 1e9, "W"),
    "energy_j": Bound(0, 1e9, "J"),
    "battery_j": Bound(0, 1e12, "J", above=True),
    "charge_j": Bound(0, 1e12, "J"),
    "diagonal": Bound(1, 1.415),
    "capacity": Bound(0, 10**6, "rovers"),
    "dock_s": Bound(0, _LONGEST_S, "s"),
    # teams and missions
    "carriers": Bound(1, MOST_ROBOTS, "robots"),
    "rovers_per_carrier": Bound(0, MOST_ROBOTS, "robots"),
    "seed": Bound(0, 10**12),
    "simulation_speed": Bound(0.1, 10_000, "s of mission time a second"),
    "time_s": Bound(0, _LONGEST_S, "s", above=True),
    "time_limit_ms": Bound(1, 1000 * _LONGEST_S, "ms"),
    "budget_s": Bound(0, 1e6, "s", above=True),
    "budget_steps": Bound(1, 10**12),
    # situations and plans
    "duration_ms": Bound(0, LONGEST_MS, "ms"),
    "start_ms": Bound(-LONGEST_MS, LONGEST_MS, "ms"),
    "reveal_m2": Bound(0, MOST, "m2"),
    # what robots report
    "remaining_s": Bound(0, 1e9, "s"),
    "distance_m": Bound(0, 1e12, "m"),
    "report": Bound(1, 10**9),
    "command": Bound(1, 10**12),
}

# fields whose bound has another name
_OF_FIELDS = {
    **dict.fromkeys(("dock_ms", "undock_ms", "free_at_ms"), "duration_ms"),
    **dict.fromkeys(("at_s", "for_s", "from_s", "until_s", "undock_s"), "dock_s"),
    **dict.fromkeys(("idle_w", "stand_w", "drive_w", "charge_w"), "power_w"),
    **dict.fromkeys(("metre_j", "stop_j"), "energy_j"),
    **{"capacity_j": "battery_j", "priority": "zone_weight", "width": "side", "height": "side"},
}


def bound_of(field: str) -> Bound:
    """Return the bound of a field."""
    return BOUNDS[_OF_FIELDS.get(field, field)]


def field_problems(value: object, path: str, *keys: str) -> Iterator[Problem]:
    """Yield what is wrong with these fields of an object; `path` is put before their names."""
    for key in keys:
        if fault := bound_of(key).fault(getattr(value, key)):
            yield Problem(path + key, fault)


def team_fault(robots: int) -> str | None:
    """Return what is wrong with the number of robots in a team, or None."""
    if robots <= MOST_ROBOTS:
        return None
    return f"a team has at most {MOST_ROBOTS} robots with all rovers, this one {robots}"
