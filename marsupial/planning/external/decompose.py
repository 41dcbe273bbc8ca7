"""Split a situation that is too big for an engine into parts that it can plan at once.

A part is a carrier with the rovers aboard it and those on the ground that it can best fetch, or a rover on the ground
by itself that has targets in reach. Robots of parts are disjoint. Targets go, the soonest served first, to the part
that can be there soonest, as long as that part has room: what no part has room for is left to a later replanning. Of
the meeting points a part keeps the best two for each thing it may need one for. Merged, the parts' plans are one plan.

Wurm et al. 2010 don't split: their planner gets the whole problem, and their section V-A expects worse plans for teams
of far more than 24 robots.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from marsupial.model import Plan, RobotState, Role, Situation
from marsupial.planning.matching import least_assignment

NEVER = 1 << 50  # time in ms that means never; many of them can be added


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
    # Parts without a target are left out, unless the goal asks for rovers aboard or carriers at home.
    if limit.fits(situation):
        return (situation,)
    times = _Times(situation)
    crews = _crews(situation, times, limit)
    shares = _share_targets(situation, times, crews, limit)
    names = [target.name for target in situation.targets]
    reach = [dict(zip(names, times.crew(crew).tolist(), strict=True)) for crew in crews]
    order = sorted(range(len(crews)), key=lambda i: (min((reach[i][t] for t in shares[i]), default=NEVER), i))
    keep_idle = _asks_more(situation)
    return tuple(_part(situation, times, crews[i], shares[i], limit) for i in order if shares[i] or keep_idle)


def merge(plans: Iterable[Plan]) -> Plan:
    """Return the plan of all actions of plans for disjoint robots."""
    return Plan.of(action for plan in plans for action in plan.actions)


def _asks_more(situation: Situation) -> bool:
    return situation.goal.recover_rovers or situation.goal.return_home


Crew = tuple[RobotState, ...]


class _Times:
    """The earliest times (ms) at which robots could be at places, regardless of the others."""

    def __init__(self, situation: Situation) -> None:
        self.situation = situation
        self._tables = {name: np.where(table < 0, NEVER, table) for name, table in situation.travel_ms.items()}
        index = situation.place_index
        self.targets = np.array([index[target.name] for target in situation.targets], dtype=np.intp)
        self.meetings = np.array([index[name] for name in situation.meetings], dtype=np.intp)
        self._may = {
            kind.name: np.array([kind.name in target.explorers for target in situation.targets], dtype=np.bool_)
            for kind in situation.types
        }

    def at_meetings(self, robot: RobotState) -> np.ndarray:
        """Return, per meeting, when a robot on the ground could be there."""
        return self._from(robot)[self.meetings]

    def to_targets(self, kind: str) -> np.ndarray:
        """Return travel (meetings, targets) of a type, `NEVER` into what it can't explore."""
        table = self._tables[kind][np.ix_(self.meetings, self.targets)]
        return np.where(self._may[kind][None, :], table, NEVER)

    def from_targets(self, kind: str) -> np.ndarray:
        """Return travel (targets, meetings) of a type."""
        return self._tables[kind][np.ix_(self.targets, self.meetings)]

    def alone(self, robot: RobotState) -> np.ndarray:
        """Return, per target, when a robot on the ground could be there by itself."""
        return np.where(self._may[robot.type], self._from(robot)[self.targets], NEVER)

    def delivered(self, rover: RobotState, carrier: RobotState) -> np.ndarray:
        """Return, (meetings, targets), when the rover could be there if the carrier sets it down at that meeting."""
        kind = self.situation.type_by_name[rover.type]
        ready = self.at_meetings(carrier)
        if rover.carrier is None:
            ready = np.full_like(ready, self.boarded(rover, carrier).min(initial=NEVER)) + ready
        return np.minimum(ready[:, None] + kind.undock_ms + self.to_targets(rover.type), NEVER)

    def boarded(self, rover: RobotState, carrier: RobotState) -> np.ndarray:
        """Return, per meeting, when a rover on the ground could be aboard the carrier if it docks there."""
        both = np.maximum(self.at_meetings(rover), self.at_meetings(carrier))
        return np.minimum(both + self.situation.type_by_name[rover.type].dock_ms, NEVER)

    def crew(self, crew: Crew) -> np.ndarray:
        """Return, per target, when the first of a crew could be there."""
        carriers = [robot for robot in crew if self.situation.type_by_name[robot.type].role is Role.CARRIER]
        best = np.full(len(self.targets), NEVER, dtype=np.int64)
        for robot in crew:
            if robot.place is not None:
                best = np.minimum(best, self.alone(robot))
            for carrier in carriers if robot not in carriers else ():
                best = np.minimum(best, self.delivered(robot, carrier).min(axis=0, initial=NEVER))
        return best

    def _from(self, robot: RobotState) -> np.ndarray:
        row = self._tables[robot.type][self.situation.place_index[robot.place or ""]]
        return np.asarray(np.minimum(row + robot.free_at_ms, NEVER))


def _crews(situation: Situation, times: _Times, limit: PartSize) -> list[Crew]:
    """Return the crews: a carrier first in each, and rovers that work alone."""
    carriers = situation.of_role(Role.CARRIER)
    rovers = situation.of_role(Role.ROVER)
    aboard = {carrier.name: [r for r in rovers if r.carrier == carrier.name] for carrier in carriers}
    out = [rover for rover in rovers if rover.carrier is None]
    if _asks_more(situation):
        fetchers = _seats(times, out, aboard)
        alone = [rover for rover in out if rover.name not in fetchers]
    else:
        # A rover that has a target in reach goes on by itself; one that has none waits for a carrier.
        alone = [rover for rover in out if times.alone(rover).min(initial=NEVER) < NEVER]
        stranded = [rover for rover in out if rover not in alone]
        free = {carrier.name: limit.rovers - len(aboard[carrier.name]) for carrier in carriers}
        fetchers = _nearest(times, carriers, stranded, free)
    crews = [
        (
            carrier,
            *aboard[carrier.name][: None if _asks_more(situation) else limit.rovers],
            *(rover for rover in out if fetchers.get(rover.name) == carrier.name),
        )
        for carrier in carriers
    ]
    return crews + [(rover,) for rover in alone]


def _seats(times: _Times, out: list[RobotState], aboard: dict[str, list[RobotState]]) -> dict[str, str]:
    """Return, per rover on the ground, the carrier that brings it back: least total time, within capacity."""
    seats: list[RobotState] = []
    for carrier in times.situation.of_role(Role.CARRIER):
        free = times.situation.type_by_name[carrier.type].capacity - len(aboard[carrier.name])
        seats += [carrier] * free
    if not seats or not out:
        return {}
    cost = np.array([[times.boarded(rover, seat).min(initial=NEVER) for seat in seats] for rover in out])
    rows, columns = least_assignment(cost)
    return {out[i].name: seats[j].name for i, j in zip(rows, columns, strict=True) if cost[i, j] < NEVER}


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


def _share_targets(situation: Situation, times: _Times, crews: list[Crew], limit: PartSize) -> list[frozenset[str]]:
    """Return each crew's targets: the soonest pair first, counting the work that a crew has already."""
    shares: list[set[int]] = [set() for _ in crews]
    if not len(situation.targets) or not crews:
        return [frozenset() for _ in crews]
    reach = np.array([times.crew(crew) for crew in crews])
    left = reach.copy()
    while left.min() < NEVER:
        crew, target = (int(k) for k in np.unravel_index(int(np.argmin(left)), left.shape))
        shares[crew].add(target)
        busy_ms = reach[crew, target] // len(crews[crew])
        left[crew] = np.where(left[crew] < NEVER, left[crew] + busy_ms, NEVER)
        left[:, target] = NEVER
        # A single robot gets at most two targets, as others may be nearer later.
        if len(shares[crew]) >= min(limit.targets, len(crews[crew]) + 1):
            left[crew, :] = NEVER
    names = [target.name for target in situation.targets]
    return [frozenset(names[t] for t in share) for share in shares]


def _part(situation: Situation, times: _Times, crew: Crew, share: frozenset[str], limit: PartSize) -> Situation:
    return situation.restricted(
        robots=frozenset(robot.name for robot in crew),
        targets=share,
        meetings=frozenset(_meetings(situation, times, crew, share, limit.choices)),
    )


def _meetings(situation: Situation, times: _Times, crew: Crew, share: frozenset[str], choices: int) -> Iterator[str]:
    """Yield the meetings a part needs, the best ones for each need; a rover by itself needs none."""
    carriers = [robot for robot in crew if situation.type_by_name[robot.type].role is Role.CARRIER]
    columns = [i for i, target in enumerate(situation.targets) if target.name in share]
    for carrier in carriers:
        for rover in (robot for robot in crew if robot not in carriers):
            needs = list(times.delivered(rover, carrier)[:, columns].T)
            if rover.carrier is None:
                needs.append(times.boarded(rover, carrier))
            if _asks_more(situation):
                needs += list(times.at_meetings(carrier) + times.from_targets(rover.type)[columns])
            for need in needs:
                best = np.argsort(need, kind="stable")[:choices]
                yield from (situation.meetings[i] for i in best if need[i] < NEVER)
