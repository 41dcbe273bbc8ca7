"""The plan that a mission follows, from the lines of its log (`docs/mission-log.md`)."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

Place = Sequence[int]


@dataclass(slots=True)
class FollowedPlan:
    """The last plan: cells of its targets and meeting points in the mission's frame; robots and places by time.

    A meeting point has the cells of the carrier and of the rover.
    """

    targets: dict[str, Place] = field(default_factory=dict)
    meetings: dict[str, tuple[Place, Place]] = field(default_factory=dict)
    ways: list[tuple[str, str]] = field(default_factory=list)
    _known: dict[str, dict[str, Any]] = field(default_factory=dict)

    def take(self, line: str) -> None:
        """Take a line of the log, if it has a plan."""
        if not line.startswith('{"event":"plan"'):
            return
        plan = json.loads(line)
        # a place that the last plan had too is a name alone; unknown ones are from before this bridge was started
        places = [one for key in ("targets", "meetings") for one in plan[key]]
        given = {one["name"]: one for one in places if isinstance(one, dict)}
        named = {one: self._known[one] for one in places if isinstance(one, str) and one in self._known}
        self._known = named | given
        self.targets = {name: one["cell"] for name, one in self._known.items() if "cell" in one}
        self.meetings = {
            name: (one["carrier_cell"], one["rover_cell"]) for name, one in self._known.items() if "rover_cell" in one
        }
        actions = sorted(plan["actions"], key=lambda one: one["start_ms"])
        self.ways = [(one["robot"], one["place"]) for one in actions]
