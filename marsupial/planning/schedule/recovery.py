"""The end of a plan made step by step: every rover is picked up, every carrier drives home.

The rover that can be aboard soonest is picked up first, unless that takes a place that another rover needs: a matching
of the rovers left to free places has to stay possible. If need be, rovers are carried elsewhere first, or one aboard is
set down to be picked up by another carrier.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import EPSILON_MS, Role, Situation
from marsupial.model.grid import Mask
from marsupial.planning.reachability import matching
from marsupial.planning.schedule.costs import NEVER, Costs
from marsupial.planning.schedule.insertions import Arrivals
from marsupial.planning.schedule.kernels import soonest_aboard
from marsupial.planning.schedule.timeline import Timeline, Transport, board, follow


def recover(timeline: Timeline, costs: Costs) -> tuple[Timeline, str]:
    """Pick up every rover; return the timeline and a sentence about those left, if any."""
    recovered, left = _recovered(timeline, costs, transports_first=False)
    # try again with rovers that need transports first, before the carriers for that are full
    if left:
        other = _recovered(timeline, costs, transports_first=True)
        recovered, left = (recovered, left) if other[1] else other
    return recovered, f"list scheduling found no place on a carrier for {left[0]}" if left else ""


def _recovered(timeline: Timeline, costs: Costs, *, transports_first: bool) -> tuple[Timeline, list[str]]:
    """Return the timeline with rovers picked up, and the names of the rovers left."""
    known, stranded_ms = Arrivals(timeline, costs), _stranded_ms(timeline.situation)
    # Transports on full carriers set other rovers down, possibly for ever.
    for _ in range(3 * len(known.rovers)):
        if (known.aboard >= 0).all():
            break
        step = _Pickups(known, stranded_ms, transports_first=transports_first).next()
        if step is None:
            break
        known.advance(step)
    return known.timeline, [known.robots[known.rovers[i]] for i in np.flatnonzero(known.aboard < 0)]


def go_home(timeline: Timeline) -> str:
    """Drive carriers home; return a sentence about the first that can't get there, if any."""
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
    """Which carrier could pick up which rover, when and where. Rovers are indices into `Arrivals.robots`."""

    def __init__(self, known: Arrivals, stranded_ms: Ints, *, transports_first: bool) -> None:
        self.known, self.timeline, self.transports_first = known, known.timeline, transports_first
        self.meetings = known.timeline.situation.meetings
        self.carriers = [known.robots[c] for c in known.carriers]
        self.out = [known.rovers[i] for i in np.flatnonzero(known.aboard < 0)]
        # (carriers, groups): rovers aboard, and seats left; (carriers,): places left
        number = known.aboard * len(known.firsts) + known.groups[known.rovers]
        taken = np.bincount(number[known.aboard >= 0], minlength=known.seats.size).reshape(known.seats.shape)
        self.free, self.free_seats = known.places - taken.sum(axis=1), known.seats - taken
        self.all_fit = known.seats.all()
        self.carrier_ms = known.arrive_ms[known.carriers] + stranded_ms

    def next(self) -> Timeline | None:
        """Return the timeline one step further: with a rover picked up or, if need be, another set down."""
        for alone in (True, False):
            journeys = {v: self.known.relay(v, alone=alone) for v in self.out}
            step = self._board_one(journeys, every=True) or self._make_room(journeys, alone=alone)
            if step is not None:
                return step
        return self._board_one(journeys, every=False)

    def _board_one(self, journeys: Mapping[int, _Journey], *, every: bool) -> Timeline | None:
        """Return the timeline with the soonest pick-up after which as many others (`every`: all) find a place."""
        aboard_ms = self._aboard_ms(journeys)
        groups = self.known.groups[self.out]
        placed = _most_placed(aboard_ms < NEVER, groups, self.free, self.free_seats)
        if every and placed < len(self.out):
            return None
        wanted = np.where((self.free > 0) & (self.free_seats[:, groups].T > 0), aboard_ms, NEVER)
        for row, k in self._in_order(wanted):
            free, seats = self.free.copy(), self.free_seats.copy()
            free[k] -= 1
            seats[k, groups[row]] -= 1
            # This pick-up must not cost another rover its place.
            others = np.arange(len(groups)) != row
            if _most_placed(aboard_ms[others] < NEVER, groups[others], free, seats) + 1 < placed:
                continue
            step = self._board(self.out[row], k, journeys[self.out[row]])
            if step is not None:
                return step
        return None

    def _in_order(self, aboard_ms: Ints) -> Iterator[tuple[int, int]]:
        """Yield the feasible pairs of a rover on the ground and a carrier, the soonest first."""
        untried = aboard_ms
        if self.transports_first:
            direct_ms = self._aboard_ms({v: self.known.relay(v, alone=True) for v in self.out})
            yield from _soonest_first(np.where(direct_ms < NEVER, NEVER, untried))
            untried = np.where(direct_ms < NEVER, untried, NEVER)
        yield from _soonest_first(untried)

    def _make_room(self, out: Mapping[int, _Journey], *, alone: bool) -> Timeline | None:
        """Return the timeline with a rover set down so that more can be aboard in the end, or None if none helps."""
        aboard = [v for v in self.known.rovers if v not in out]
        journeys = {v: self.known.relay(v, alone=alone) for v in aboard} | dict(out)
        options = {
            v: [int(k) for k in np.argsort(times, kind="stable") if times[k] < NEVER]
            for v, times in zip(journeys, self._aboard_ms(journeys), strict=True)
        }
        own = {v: self.carriers.index(self.timeline.on[self.known.robots[v]] or "") for v in aboard}
        for v, k in own.items():
            # Its own carrier first: a rover stays aboard unless its place is needed.
            options[v] = [k, *(other for other in options[v] if other != k)]
        groups = self.known.groups[list(options)].tolist()
        found = matching(list(options.values()), groups, self.known.places.tolist(), self.known.seats.tolist())
        chosen = dict(zip(options, found, strict=True))
        for v in aboard:
            if chosen[v] != own[v]:
                timeline = self.timeline.copy()
                meeting = self._meeting(v, chosen[v], journeys[v][0])
                return timeline if follow(timeline, self.known.robots[v], meeting, journeys[v][1]) else None
        return None

    def _board(self, v: int, k: int, journey: _Journey) -> Timeline | None:
        meeting = self._meeting(v, k, journey[0])
        rover, carrier, place = self.known.robots[v], self.carriers[k], self.meetings[meeting]
        timeline = self.timeline.copy()
        if not follow(timeline, rover, meeting, journey[1]) or not timeline.can_drive(carrier, place):
            return None
        return timeline if board(timeline, rover, carrier, place) else None

    def _aboard_ms(self, journeys: Mapping[int, _Journey]) -> Ints:
        """Return (journeys, carriers): when each rover could be aboard a carrier that can go home where it has to."""
        ready_ms = np.array([times for times, _ in journeys.values()], dtype=np.int64)
        docking_ms = self.known.docking_ms[list(journeys)] - EPSILON_MS
        aboard_ms = np.empty((len(journeys), len(self.carriers)), dtype=np.int64)
        soonest_aboard(ready_ms.reshape(len(journeys), -1), self.carrier_ms.T.copy(), docking_ms, aboard_ms)
        if not self.all_fit:
            aboard_ms[self.known.seats[:, self.known.groups[list(journeys)]].T == 0] = NEVER
        return aboard_ms

    def _meeting(self, v: int, k: int, ready_ms: Ints) -> int:
        """Return the meeting at which a rover could be aboard a carrier soonest."""
        docked = np.maximum(ready_ms, self.carrier_ms[k]) + self.known.docking_ms[v] - EPSILON_MS
        return int(np.argmin(np.minimum(docked, NEVER)))


# per meeting when a rover could be there, and the transports that bring it there
_Journey = tuple[Ints, Mapping[int, Transport]]


def _stranded_ms(situation: Situation) -> Ints:
    """Return (carriers, meetings): `NEVER` where a carrier that has to end at home could not drive there, else 0."""
    carriers = situation.of_role(Role.CARRIER)
    stranded = np.zeros((len(carriers), len(situation.meetings)), dtype=np.int64)
    for k, robot in enumerate(carriers):
        if situation.goal.return_home and robot.home is not None:
            legs = [situation.travel(robot.type, meeting, robot.home) for meeting in situation.meetings]
            stranded[k] = [NEVER if leg is None else 0 for leg in legs]
    return stranded


def _soonest_first(times: Ints) -> Iterator[tuple[int, int]]:
    """Yield the indices of the entries before `NEVER`, in order of time; lazily, as few are ever used."""
    untried = times.copy()
    while untried.min(initial=NEVER) < NEVER:
        row, column = divmod(int(np.argmin(untried)), untried.shape[1])
        untried[row, column] = NEVER
        yield row, column


def _most_placed(fits: Mask, groups: Ints, places: Ints, seats: Ints) -> int:
    """Return the most rovers that find a place; `fits` is (rovers, carriers): who could board which.

    `groups` (rovers,) are the rovers' seat groups; `places` (carriers,) and `seats` (carriers, groups) are free.
    """
    if seats.shape[1] == 1 and fits[:, seats[:, 0] > 0].all():
        return min(len(fits), int(seats.sum()))
    options = [np.flatnonzero(row).tolist() for row in fits]
    return sum(carrier >= 0 for carrier in matching(options, groups.tolist(), places.tolist(), seats.tolist()))
