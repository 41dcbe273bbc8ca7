"""Split a situation that is too big for an engine into parts that it can plan at once.

A part is a carrier with the rovers aboard it and those on the ground that it can best fetch, or a single rover on the
ground that has targets in reach. Parts have disjoint robots. Each target, the soonest served first, goes to the part
that can reach it soonest and has room; targets that fit in no part wait for a later replanning. A part includes the
best two meeting points for each of its needs. The parts' plans merge into one plan.

Wurm et al. 2010 don't split: their planner gets the whole problem, and their section V-A expects worse plans for teams
of far more than 24 robots.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import RobotState, Role, Situation
from marsupial.planning.matching import least_assignment
from marsupial.planning.reachability import matching
from marsupial.planning.schedule.costs import Costs

# time in ms that means never: less than that of `Costs`, as sums of assignments are floats and have to be exact
NEVER = 1 << 50


@dataclass(frozen=True, slots=True, kw_only=True)
class PartSize:
    """The largest size of a part."""

    carriers: int = 1  # whole situations with more are split
    rovers: int = 2  # rovers beside the carrier; more are kept only where a rover has no other to bring it back
    targets: int = 3  # targets per part
    meetings: int = 4  # whole situations with more are split
    # meetings a part keeps for each need: a rover to a target, a rover to its carrier, a target back to the carrier
    choices: int = 2
    seconds: float = 0.0  # what an engine needs to find a first plan for such a part, measured

    def fits(self, situation: Situation) -> bool:
        """Return whether the whole situation fits in one part."""
        return (
            len(situation.of_role(Role.CARRIER)) <= self.carriers
            and len(situation.of_role(Role.ROVER)) <= self.rovers
            and len(situation.targets) <= self.targets
            and len(situation.meetings) <= self.meetings
        )


def decompose(situation: Situation, limit: PartSize) -> tuple[Situation, ...]:
    """Return the parts of a situation, those that can explore something soonest first; itself if it fits."""
    if limit.fits(situation):
        return (situation,)
    times = _Times(situation)
    crews = _crews(times, limit)
    reach = np.array([times.crew(crew) for crew in crews], dtype=np.int64).reshape(len(crews), len(situation.targets))
    shares = _share_targets(reach, crews, limit)
    order = sorted(range(len(crews)), key=lambda i: (min((reach[i, t] for t in shares[i]), default=NEVER), i))
    # Parts without a target are omitted, unless the goal requires rovers aboard or carriers at home.
    return tuple(_part(times, crews[i], shares[i], limit) for i in order if shares[i] or situation.goal.aboard)


Crew = tuple[RobotState, ...]


class _Times:
    """The earliest times (ms) at which robots could be at places, regardless of the others."""

    def __init__(self, situation: Situation) -> None:
        self.situation, self.costs = situation, Costs(situation)
        self.row = {kind.name: k for k, kind in enumerate(situation.types)}

    def at_meetings(self, robot: RobotState) -> Ints:
        """Return, per meeting, when a robot on the ground could be there."""
        return self._from(robot, self.costs.meet)

    def alone(self, robot: RobotState) -> Ints:
        """Return, per target, when a robot on the ground could drive there itself."""
        return self._from(robot, self.costs.explore)

    def delivered(self, rover: RobotState, carrier: RobotState) -> Ints:
        """Return, (meetings, targets), when the rover could be there if the carrier sets it down at that meeting."""
        ready = self.at_meetings(carrier) + self.situation.type_by_name[rover.type].undock_ms
        if rover.carrier is None:
            ready = ready + self.boarded(rover, carrier).min(initial=NEVER)
        return np.minimum(ready[:, None] + self.costs.sortie[self.row[rover.type]], NEVER)

    def boarded(self, rover: RobotState, carrier: RobotState) -> Ints:
        """Return, per meeting, when a rover on the ground could be aboard the carrier if it docks there."""
        if not self.situation.most_aboard(carrier.name, rover.name):
            return np.full(len(self.situation.meetings), NEVER, dtype=np.int64)
        both = np.maximum(self.at_meetings(rover), self.at_meetings(carrier))
        return np.minimum(both + self.situation.type_by_name[rover.type].dock_ms, NEVER)

    def carriers(self, crew: Crew) -> list[RobotState]:
        return [robot for robot in crew if self.situation.type_by_name[robot.type].role is Role.CARRIER]

    def crew(self, crew: Crew) -> Ints:
        """Return, per target, when the first of a crew could be there."""
        carriers = self.carriers(crew)
        best = np.full(len(self.situation.targets), NEVER, dtype=np.int64)
        for robot in crew:
            if robot.place is not None:
                best = np.minimum(best, self.alone(robot))
            for carrier in carriers if robot not in carriers else ():
                best = np.minimum(best, self.delivered(robot, carrier).min(axis=0, initial=NEVER))
        return best

    def _from(self, robot: RobotState, table: Ints) -> Ints:
        row = table[self.row[robot.type], self.situation.place_index[robot.place or ""]]
        return np.minimum(row + robot.free_at_ms, NEVER)


def _crews(times: _Times, limit: PartSize) -> list[Crew]:
    """Return the crews: a carrier first in each, and rovers that work alone."""
    carriers, rovers = (times.situation.of_role(role) for role in (Role.CARRIER, Role.ROVER))
    recover = times.situation.goal.aboard
    aboard = {carrier.name: [r for r in rovers if r.carrier == carrier.name] for carrier in carriers}
    out = [rover for rover in rovers if rover.carrier is None]
    if recover:
        fetchers = _seats(times, out, aboard)
        alone = [rover for rover in out if rover.name not in fetchers]
    else:
        # A rover with a target in reach continues by itself; a rover without one waits for a carrier.
        alone = [rover for rover in out if times.alone(rover).min(initial=NEVER) < NEVER]
        stranded = [rover for rover in out if rover not in alone]
        free = {carrier.name: limit.rovers - len(aboard[carrier.name]) for carrier in carriers}
        fetchers = _nearest(times, carriers, stranded, free)
    most = None if recover else limit.rovers
    crews: list[Crew] = []
    for carrier in carriers:
        fetched = (rover for rover in out if fetchers.get(rover.name) == carrier.name)
        crews.append((carrier, *aboard[carrier.name][:most], *fetched))
    return [*crews, *((rover,) for rover in alone)]


def _seats(times: _Times, out: list[RobotState], aboard: dict[str, list[RobotState]]) -> dict[str, str]:
    """Return, per rover on the ground, the carrier that brings it back: least total time, within capacity."""
    situation, carriers = times.situation, times.situation.of_role(Role.CARRIER)
    free = [situation.type_by_name[c.type].capacity - len(aboard[c.name]) for c in carriers]
    if situation.has_seats:
        return _fitting_seats(times, out, aboard, free)
    seats = [carrier for carrier, number in zip(carriers, free, strict=True) for _ in range(number)]
    if not seats or not out:
        return {}
    cost = np.array([[times.boarded(rover, seat).min(initial=NEVER) for seat in seats] for rover in out])
    rows, columns = least_assignment(cost)
    return {out[i].name: seats[j].name for i, j in zip(rows, columns, strict=True) if cost[i, j] < NEVER}


def _fitting_seats(
    times: _Times, out: list[RobotState], aboard: dict[str, list[RobotState]], free: list[int]
) -> dict[str, str]:
    """Return the same where rovers fit only on some carriers; the total time is not the least."""
    situation, carriers = times.situation, times.situation.of_role(Role.CARRIER)
    seat = {robot.name: situation.type_by_name[robot.type].seat for robot in situation.robots}
    groups = {seat[rover.name]: rover.name for rover in out}
    left = [
        [situation.most_aboard(c.name, r) - sum(seat[o.name] == g for o in aboard[c.name]) for g, r in groups.items()]
        for c in carriers
    ]
    options = []
    for rover in out:
        soonest = sorted((int(times.boarded(rover, c).min(initial=NEVER)), k) for k, c in enumerate(carriers))
        options.append([k for ms, k in soonest if ms < NEVER])
    found = matching(options, [list(groups).index(seat[rover.name]) for rover in out], free, left)
    return {rover.name: carriers[k].name for rover, k in zip(out, found, strict=True) if k >= 0}


def _nearest(
    times: _Times, carriers: tuple[RobotState, ...], rovers: list[RobotState], free: dict[str, int]
) -> dict[str, str]:
    """Return, per rover, the carrier that can fetch it soonest, as long as carriers' crews have room."""
    pairs = sorted(
        (int(times.boarded(rover, carrier).min(initial=NEVER)), i, k)
        for i, rover in enumerate(rovers)
        for k, carrier in enumerate(carriers)
    )
    chosen: dict[str, str] = {}
    for cost, i, k in pairs:
        carrier = carriers[k].name
        if cost < NEVER and rovers[i].name not in chosen and free[carrier] > 0:
            chosen[rovers[i].name] = carrier
            free[carrier] -= 1
    return chosen


def _share_targets(reach: Ints, crews: list[Crew], limit: PartSize) -> list[set[int]]:
    """Return each crew's targets: the soonest pair first, counting the work that a crew has already."""
    shares: list[set[int]] = [set() for _ in crews]
    left = reach.copy()
    while left.min(initial=NEVER) < NEVER:
        crew, target = (int(k) for k in np.unravel_index(int(np.argmin(left)), left.shape))
        shares[crew].add(target)
        busy_ms = reach[crew, target] // len(crews[crew])
        left[crew] = np.where(left[crew] < NEVER, left[crew] + busy_ms, NEVER)
        left[:, target] = NEVER
        # A single robot gets at most two targets, as other robots may be nearer later.
        if len(shares[crew]) >= min(limit.targets, len(crews[crew]) + 1):
            left[crew, :] = NEVER
    return shares


def _part(times: _Times, crew: Crew, share: set[int], limit: PartSize) -> Situation:
    return times.situation.restricted(
        robots=frozenset(robot.name for robot in crew),
        targets=frozenset(times.situation.targets[t].name for t in share),
        meetings=frozenset(_meetings(times, crew, sorted(share), limit.choices)),
    )


def _meetings(times: _Times, crew: Crew, targets: list[int], choices: int) -> Iterator[str]:
    """Yield the meetings a part needs, the best ones for each need; a single rover needs none."""
    situation, carriers = times.situation, times.carriers(crew)
    places = [situation.place_index[situation.targets[t].name] for t in targets]
    for carrier in carriers:
        for rover in (robot for robot in crew if robot not in carriers):
            needs = list(times.delivered(rover, carrier)[:, targets].T)
            if rover.carrier is None:
                needs.append(times.boarded(rover, carrier))
            if situation.goal.aboard:
                needs += list(times.at_meetings(carrier) + times.costs.meet[times.row[rover.type], places])
            for need in needs:
                best = np.argsort(need, kind="stable")[:choices]
                yield from (situation.meetings[i] for i in best if need[i] < NEVER)
