"""All insertions of one more target at the end of a timeline, and the soonest one for each target.

They follow from when every robot could be at every meeting, by itself or with transports (`Arrivals`).

A robot on the ground goes itself; a carrier sets down a rover it carries at a meeting; or a carrier first picks up a
rover on the ground at one meeting (a full one sets down another there) and carries it to a second. A rover's way to the
meeting where it is set down does not matter afterwards, so the table of transports is over meetings:

    robot alone              place ----------------------------------> target     `alone_ms`
    carrier has it aboard    carrier --> meeting --------------------> target     `landed_ms[0]`
    carrier fetches it       carrier --> meeting --> second meeting -> target     `landed_ms[1 + carrier]`
                             rover ----> meeting

A step changes few robots, so few rows have to be repaired after it. Chains of several transports are found by a search
of their own (`Arrivals.relay`), since they are rarely needed.
"""

from collections.abc import Iterable

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import EPSILON_MS, Role
from marsupial.model.grid import Mask
from marsupial.planning.schedule.costs import NEVER, Costs
from marsupial.planning.schedule.kernels import RobotArrays, renew_landed, soonest
from marsupial.planning.schedule.timeline import Timeline, Transport


class Arrivals:
    """When robots, numbered as in the situation, could be at meetings; updated for the few that a step changes."""

    def __init__(self, timeline: Timeline, costs: Costs) -> None:
        situation = timeline.situation
        self.costs = costs
        self.robots = [robot.name for robot in situation.robots]
        self.row = {name: i for i, name in enumerate(self.robots)}
        types = [situation.type_of(name) for name in self.robots]
        numbers = {kind.name: k for k, kind in enumerate(situation.types)}
        # int64 (robots,): the number of each robot's type
        self.kinds: Ints = np.array([numbers[kind.name] for kind in types], dtype=np.int64)
        # int64 (robots,): from beginning to dock to being ready again
        self.docking_ms: Ints = np.array([max(1, kind.dock_ms) + EPSILON_MS for kind in types], dtype=np.int64)
        undocking_ms = np.array([max(1, kind.undock_ms) + EPSILON_MS for kind in types], dtype=np.int64)
        # int64 (robots, meetings): the same for an undock, `NEVER` where the robot can't stand
        self.set_down_ms: Ints = undocking_ms[:, None] + np.diagonal(costs.stay, axis1=1, axis2=2)[self.kinds]
        self.carriers = [i for i, kind in enumerate(types) if kind.role is Role.CARRIER]
        self.rovers = [i for i, kind in enumerate(types) if kind.role is Role.ROVER]
        n_meetings = len(situation.meetings)
        self.firsts, self.groups, self.places, self.seats = costs.seating
        # int64 (robots, meetings): when each could be ready at each meeting by itself; `NEVER` while it is carried
        self.arrive_ms: Ints = np.empty((len(types), n_meetings), dtype=np.int64)
        # int64 (carriers, groups, meetings): when a rover of each group could dock at the earliest; a full carrier
        # makes room first
        self.boarding_ms: Ints = np.empty((len(self.carriers), len(self.firsts), n_meetings), dtype=np.int64)
        # int64 (rovers,): the number of the carrier that each rover is aboard, -1 on the ground
        self.aboard: Ints = np.empty(len(self.rovers), dtype=np.int64)
        self._renew(timeline, range(len(types)))

    def advance(self, timeline: Timeline) -> list[int]:
        """Update to a timeline with more actions; return the robots that take part in them."""
        new = timeline.actions[self._seen :]
        changed = sorted({self.row[robot] for action in new for robot in action.robots})
        self._renew(timeline, changed)
        return changed

    def landed(self, v: int) -> Ints:
        """Return when a rover aboard would be ready at each meeting if its carrier sets it down there."""
        carrier = self.row[self.timeline.on[self.robots[v]] or ""]
        return np.asarray(self.arrive_ms[carrier] + self.set_down_ms[v])

    def carried(self, k: int, arrive_ms: Ints, v: int) -> Ints:
        """Return (meetings, meetings): when `v`, at the first at `arrive_ms`, is ready at the second, on `k`."""
        docked = np.maximum(self.boarding_ms[k, self.groups[v]], arrive_ms) + self.docking_ms[v]
        return np.asarray(docked[:, None] + self.costs.transport[self.kinds[self.carriers[k]]] + self.set_down_ms[v])

    def relay(self, v: int, *, alone: bool = False) -> tuple[Ints, dict[int, Transport]]:
        """Return per meeting when a rover could be there, and the last transport on the way (Bellman-Ford).

        Without a transport, the rover drives there from its place. With `alone` no carrier picks it up: its carrier
        sets it down first, then it drives. Exact if no carrier is used twice, an estimate otherwise.
        """
        transports: dict[int, Transport] = {}
        on, times = self.timeline.on[self.robots[v]], np.minimum(self.arrive_ms[v], NEVER)
        if alone and on is None:
            return times, transports
        names, stay = self.timeline.situation.meetings, self.costs.stay[self.kinds[v]]
        if on is not None:
            via = self.landed(v)[:, None] + stay
            for m in np.flatnonzero(via.min(axis=0, initial=NEVER) < NEVER):
                down = int(np.argmin(via[:, m]))
                transports[int(m)] = Transport(on, pickup=None, set_down=names[down], then_to=names[m])
                times[m] = via[down, m]
        # Until nothing improves: a later transport may start from a meeting that an earlier one made reachable.
        better = not alone
        while better:
            better = False
            for k, c in enumerate(self.carriers):
                up = self.carried(k, times, v)
                landed = up.min(axis=0, initial=NEVER)[:, None] + stay
                for m in np.flatnonzero(landed.min(axis=0, initial=NEVER) < times):
                    down = int(np.argmin(landed[:, m]))
                    pickup, carrier = names[int(np.argmin(up[:, down]))], self.robots[c]
                    transports[int(m)] = Transport(carrier, pickup=pickup, set_down=names[down], then_to=names[m])
                    times[m] = landed[down, m]
                    better = True
        return times, transports

    def _renew(self, timeline: Timeline, changed: Iterable[int]) -> None:
        self.timeline, self._seen = timeline, len(timeline.actions)
        for i in changed:
            name = self.robots[i]
            at, on = timeline.at[name], timeline.on[name]
            if at is None:
                self.arrive_ms[i] = NEVER
            else:
                place = timeline.situation.place_index[at]
                np.add(self.costs.meet[self.kinds[i], place], timeline.ready_ms[name], out=self.arrive_ms[i])
            if i in self.rovers:
                self.aboard[self.rovers.index(i)] = -1 if on is None else self.carriers.index(self.row[on])
            else:
                for group, first in enumerate(self.firsts):
                    self.boarding_ms[self.carriers.index(i), group] = self._boarding(i, first)

    def _boarding(self, c: int, rover: str) -> Ints:
        """Return when a rover could dock on a carrier at each meeting at the earliest."""
        name = self.robots[c]
        if self.timeline.has_place(name, rover):
            return self.arrive_ms[c]
        leaves = self.timeline.in_the_way(name, rover)
        if leaves is None:
            return np.full(self.arrive_ms.shape[1], NEVER, dtype=np.int64)
        set_down = self.set_down_ms[self.row[leaves]]
        unloaded = self.arrive_ms[c] + set_down
        if (set_down < NEVER).all():
            return np.asarray(unloaded)
        # Where the rover does not fit, the carrier sets it down on the way.
        by_way = (unloaded[:, None] + self.costs.stay[self.kinds[c]]).min(axis=0)
        return np.where(set_down < NEVER, unloaded, by_way)


class Insertions:
    """The insertions behind a timeline, kept up to date with it; `left` are the targets not yet explored."""

    def __init__(self, timeline: Timeline, costs: Costs, left: Mask) -> None:
        self.timeline, self.costs, self.left = timeline, costs, left.copy()
        self.arrivals = Arrivals(timeline, costs)
        n, (c, _, n_meetings) = len(self.arrivals.robots), self.arrivals.boarding_ms.shape
        # int64 (robots, targets): when each robot would have explored each target alone; `NEVER` or later if it can't
        self.alone_ms: Ints = np.full((n, len(left)), NEVER, dtype=np.int64)
        # int64 (1 + carriers, rovers, meetings): when each rover would be ready at each meeting, first set down by the
        # carrier it is aboard, then carried by each carrier; `NEVER` where it can't be
        self.landed_ms: Ints = np.full((1 + c, len(self.arrivals.rovers), n_meetings), NEVER, dtype=np.int64)
        known = self.arrivals
        carriers, rovers = (np.array(robots, dtype=np.int64) for robots in (known.carriers, known.rovers))
        self._robots = RobotArrays(carriers, rovers, known.kinds, known.groups, known.docking_ms, known.set_down_ms)
        self._renew(range(n))

    def advance(self) -> None:
        """Repair the tables after actions have been added to the timeline."""
        self._renew(self.arrivals.advance(self.timeline))

    def soonest(self) -> tuple[Ints, Ints]:
        """Return per target the soonest time to explore it, `NEVER` if it can't be or is not left, and the insertion.

        Insertions are numbered: each robot alone; each rover set down by its carrier; then carriers x rovers picked up
        first.
        """
        done, insertions = np.empty_like(self.left, dtype=np.int64), np.empty_like(self.left, dtype=np.int64)
        known, sortie = self.arrivals, self.costs.sortie
        kinds = known.kinds[self._robots.rovers]
        soonest(self.alone_ms, self.landed_ms, known.aboard, kinds, sortie, self.left, done, insertions)
        return done, insertions

    def explorer(self, number: int) -> tuple[str, str | None]:
        """Return the explorer of an insertion, and the carrier that brings it, None where it goes itself."""
        robots = self.arrivals.robots
        if number < len(robots):
            return robots[number], None
        slab, k = divmod(number - len(robots), len(self._robots.rovers))
        rover = robots[self._robots.rovers[k]]
        return rover, robots[self._robots.carriers[slab - 1]] if slab else self.timeline.on[rover]

    def journey(self, rover: str, carrier: str, target: int) -> Transport:
        """Return the best transport of `rover` by `carrier` towards the target."""
        v = self.arrivals.row[rover]
        sortie = self.costs.sortie[self.arrivals.kinds[v], :, target]
        names = self.timeline.situation.meetings
        # Tables store times only; the meetings are recomputed for the chosen insertion.
        if self.timeline.on[rover] == carrier:
            place = names[int(np.argmin(self.arrivals.landed(v) + sortie))]
            return Transport(carrier, pickup=None, set_down=place, then_to=place)
        k = self.arrivals.carriers.index(self.arrivals.row[carrier])
        via = self.arrivals.carried(k, self.arrivals.arrive_ms[v], v)
        first, second = np.unravel_index(int(np.argmin(via + sortie)), via.shape)
        return Transport(carrier, pickup=names[first], set_down=names[second], then_to=names[second])

    def _renew(self, rows: Iterable[int]) -> None:
        known, stale = self.arrivals, np.zeros(len(self.alone_ms), dtype=np.bool_)
        for i in rows:
            stale[i] = True
            at = self.timeline.at[known.robots[i]]
            if at is None:
                self.alone_ms[i] = NEVER
            else:
                place = self.timeline.situation.place_index[at]
                ready = self.timeline.ready_ms[known.robots[i]]
                np.add(self.costs.explore[known.kinds[i], place], ready, out=self.alone_ms[i])
        landed, costs = self.landed_ms, self.costs
        renew_landed(self._robots, landed, stale, known.aboard, known.arrive_ms, known.boarding_ms, costs.transport)
