"""The end of a plan made step by step: every rover is picked up, every carrier drives home.

Rovers are picked up in the order of who can be aboard soonest, but no pick-up takes a place that a rover left over
would need: a matching of rovers to places is kept possible. Where that takes it, rovers get rides by other carriers, or
one that is aboard is set down to be picked up by another carrier.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from marsupial.model.robots import Role
from marsupial.model.situation import Situation
from marsupial.planning.reachability import matching
from marsupial.planning.rides import Ride, board, follow
from marsupial.planning.timeline import Timeline
from marsupial.planning.ways import NEVER, Costs, Times, Ways


def recover(timeline: Timeline, costs: Costs) -> tuple[Timeline, str]:
    """Add the picking up of every rover; return the timeline and a sentence on those left, if any."""
    rovers = [robot.name for robot in timeline.situation.of_role(Role.ROVER)]
    nothing = np.zeros(len(timeline.situation.targets), dtype=np.bool_)
    stranded_ms = _stranded_ms(timeline.situation)
    for _ in range(3 * len(rovers)):  # rides on full carriers set others down, and might do so for ever
        if all(timeline.on[rover] is not None for rover in rovers):
            break
        step = _Pickups(Ways(timeline, costs, nothing), stranded_ms).next()
        if step is None:
            break
        timeline = step
    out = [rover for rover in rovers if timeline.on[rover] is None]
    return timeline, f"list scheduling found no place on a carrier for {out[0]}" if out else ""


def go_home(timeline: Timeline) -> str:
    """Add the carriers' way home; return a sentence on the first that can't get there, if any."""
    complaint = ""
    for robot in timeline.situation.of_role(Role.CARRIER):
        if robot.home is None:
            continue
        if timeline.can_drive(robot.name, robot.home):
            timeline.move(robot.name, robot.home)
        else:
            complaint = complaint or f"{robot.name} has no path to its home {robot.home}"
    return complaint


class _Pickups:
    """Which carrier could pick up which rover, when and where. Rovers are indices into `Ways.robots`."""

    def __init__(self, ways: Ways, stranded_ms: Times) -> None:
        self.ways, self.timeline = ways, ways.timeline
        self.meetings = ways.timeline.situation.meetings
        self.carriers = [ways.robots[c] for c in ways.carriers]
        self.places = [ways.kinds[c].capacity for c in ways.carriers]
        load = [len(self.timeline.cargo[carrier]) for carrier in self.carriers]
        self.free = [places - n for places, n in zip(self.places, load, strict=True)]
        self.out = [v for v in ways.rovers if self.timeline.on[ways.robots[v]] is None]
        self.carrier_ms = ways.arrive_ms[ways.carriers] + stranded_ms

    def next(self) -> Timeline | None:
        """Return the timeline one step further: with a rover picked up or, if need be, another set down."""
        for alone in (True, False):
            journeys = {v: self.ways.relay(self.ways.robots[v], alone=alone) for v in self.out}
            step = self._board_one(journeys, every=True) or self._make_room(journeys, alone=alone)
            if step is not None:
                return step
        return self._board_one(journeys, every=False)

    def _board_one(self, journeys: Mapping[int, _Journey], *, every: bool) -> Timeline | None:
        """Return the timeline with the soonest pick-up after which as many others find a place as before.

        With `every` only if all rovers that are out find one.
        """
        aboard_ms = {v: self._aboard_ms(v, times) for v, (times, _) in journeys.items()}
        soonest = {v: table.min(axis=1, initial=NEVER) for v, table in aboard_ms.items()}
        options = {v: _by_time(times) for v, times in soonest.items()}
        seats = _seated(list(options.values()), self.free)
        if every and seats < len(self.out):
            return None
        pairs = sorted((int(soonest[v][k]), v, k) for v in self.out for k in options[v] if self.free[k] > 0)
        for _, v, k in pairs:
            free = [n - (i == k) for i, n in enumerate(self.free)]
            if _seated([options[other] for other in self.out if other != v], free) + 1 < seats:
                continue
            step = self._board(v, k, int(np.argmin(aboard_ms[v][k])), journeys[v][1])
            if step is not None:
                return step
        return None

    def _make_room(self, out: Mapping[int, _Journey], *, alone: bool) -> Timeline | None:
        """Return the timeline with a rover set down so that more can be aboard in the end, None if none helps."""
        aboard = [v for v in self.ways.rovers if v not in out]
        journeys = {v: self.ways.relay(self.ways.robots[v], alone=alone) for v in aboard} | dict(out)
        tables = {v: self._aboard_ms(v, times) for v, (times, _) in journeys.items()}
        options = {v: _by_time(table.min(axis=1, initial=NEVER)) for v, table in tables.items()}
        own = {v: self.carriers.index(self.timeline.on[self.ways.robots[v]] or "") for v in aboard}
        for v, k in own.items():
            options[v] = [k, *(other for other in options[v] if other != k)]
        chosen = dict(zip(options, matching(list(options.values()), self.places), strict=True))
        for v in aboard:
            if chosen[v] != own[v]:
                timeline = self.timeline.copy()
                meeting = int(np.argmin(tables[v][chosen[v]]))
                return timeline if follow(timeline, self.ways.robots[v], meeting, journeys[v][1]) else None
        return None

    def _board(self, v: int, k: int, meeting: int, rides: Mapping[int, Ride]) -> Timeline | None:
        rover, carrier, place = self.ways.robots[v], self.carriers[k], self.meetings[meeting]
        timeline = self.timeline.copy()
        if not follow(timeline, rover, meeting, rides) or not timeline.can_drive(carrier, place):
            return None
        board(timeline, rover, carrier, place)
        return timeline

    def _aboard_ms(self, v: int, ready: Times) -> Times:
        """Return (carriers, meetings): when `v` would be aboard, and that carrier home where it has to be."""
        done = np.maximum(ready, self.carrier_ms) + max(1, self.ways.kinds[v].dock_ms)
        done[np.array(self.places) == 0] = NEVER
        return np.minimum(done, NEVER)


_Journey = tuple[Times, Mapping[int, Ride]]
"""Per meeting when a rover could be there, and the rides that bring it there."""


def _stranded_ms(situation: Situation) -> Times:
    """Return (carriers, meetings): `NEVER` where a carrier that has to end at home could not drive there, else 0."""
    carriers = situation.of_role(Role.CARRIER)
    stranded = np.zeros((len(carriers), len(situation.meetings)), dtype=np.int64)
    for k, robot in enumerate(carriers):
        if situation.goal.return_home and robot.home is not None:
            legs = [situation.travel(robot.type, meeting, robot.home) for meeting in situation.meetings]
            stranded[k] = [NEVER if leg is None else 0 for leg in legs]
    return stranded


def _by_time(times: Times) -> list[int]:
    return [int(k) for k in np.argsort(times, kind="stable") if times[k] < NEVER]


def _seated(options: Sequence[Sequence[int]], places: Sequence[int]) -> int:
    return sum(carrier >= 0 for carrier in matching(options, places))
