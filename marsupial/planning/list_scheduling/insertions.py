"""All insertions of one more target behind a timeline, and the soonest of them for each target.

A robot on the ground goes itself; a carrier sets down a rover it carries at a meeting; or a carrier first picks up a
rover on the ground at one meeting (a full one sets down another there) and carries it to a second. How a rover got to
where it is set down does not matter from there on, so the table of transports is over meetings:

    robot alone              place ----------------------------------> target     `alone_ms`
    carrier has it aboard    carrier --> meeting --------------------> target     `landed_ms[0]`
    carrier fetches it       carrier --> meeting --> second meeting -> target     `landed_ms[1 + carrier]`
                             rover ----> meeting

A step changes few robots, so few rows have to be repaired after it. Chains of several transports are found by a search
of their own (`Arrivals.relay`), since they are rarely needed.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from marsupial.planning.list_scheduling.arrivals import Arrivals
from marsupial.planning.list_scheduling.costs import NEVER, Costs, Indices, Mask, Times
from marsupial.planning.list_scheduling.kernels import RobotArrays, renew_landed, soonest
from marsupial.planning.list_scheduling.timeline import Timeline, Transport


class Insertions:
    """The insertions behind a timeline, kept up to date with it; `left` are the targets not yet explored."""

    def __init__(self, timeline: Timeline, costs: Costs, left: Mask) -> None:
        self.timeline, self.costs, self.left = timeline, costs, left.copy()
        self.arrivals = Arrivals(timeline, costs)
        n, (c, n_meetings) = len(self.arrivals.robots), self.arrivals.boarding_ms.shape
        # int64 (robots, targets): when each robot would have explored each target alone; `NEVER` or later if it can't
        self.alone_ms: Times = np.full((n, len(left)), NEVER, dtype=np.int64)
        # int64 (1 + carriers, rovers, meetings): when each rover would be ready at each meeting, first set down by the
        # carrier it is aboard, then carried by each carrier; `NEVER` where it can't be
        self.landed_ms: Times = np.full((1 + c, len(self.arrivals.rovers), n_meetings), NEVER, dtype=np.int64)
        self._robots = RobotArrays(
            carriers=np.array(self.arrivals.carriers, dtype=np.int64),
            rovers=np.array(self.arrivals.rovers, dtype=np.int64),
            kinds=self.arrivals.kinds,
            docking=self.arrivals.docking_ms,
            undocking=self.arrivals.undocking_ms,
        )
        self._renew(range(n))

    def advance(self) -> None:
        """Repair the tables after actions have been added to the timeline."""
        self._renew(self.arrivals.advance(self.timeline))

    def soonest(self) -> tuple[Times, Indices]:
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
        # Tables keep times only; the meetings are found again for the insertion chosen.
        if self.timeline.on[rover] == carrier:
            place = names[int(np.argmin(self.arrivals.landed(v) + sortie))]
            return Transport(carrier=carrier, pickup=None, set_down=place, then_to=place)
        k = self.arrivals.carriers.index(self.arrivals.row[carrier])
        via = self.arrivals.carried(k, self.arrivals.arrive_ms[v], v)
        first, second = np.unravel_index(int(np.argmin(via + sortie)), via.shape)
        return Transport(carrier=carrier, pickup=names[first], set_down=names[second], then_to=names[second])

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
