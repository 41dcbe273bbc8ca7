"""When every robot could be at every meeting after a timeline: by itself, or with transports.

Updated with the timeline robot by robot, since few robots change from one step to the next.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from marsupial.model import EPSILON_MS, Role
from marsupial.planning.list_scheduling.costs import NEVER, Costs, Indices, Times
from marsupial.planning.list_scheduling.timeline import Timeline, Transport


class Arrivals:
    """When robots could be at meetings; robots are numbered as in the situation."""

    def __init__(self, timeline: Timeline, costs: Costs) -> None:
        situation = timeline.situation
        self.costs = costs
        self.robots = [robot.name for robot in situation.robots]
        self.row = {name: i for i, name in enumerate(self.robots)}
        types = [situation.type_of(name) for name in self.robots]
        numbers = {kind.name: k for k, kind in enumerate(situation.types)}
        # int64 (robots,): the number of each robot's type
        self.kinds: Indices = np.array([numbers[kind.name] for kind in types], dtype=np.int64)
        # from beginning to dock or undock to being ready again
        self.docking_ms: Times = np.array([max(1, kind.dock_ms) + EPSILON_MS for kind in types], dtype=np.int64)
        self.undocking_ms: Times = np.array([max(1, kind.undock_ms) + EPSILON_MS for kind in types], dtype=np.int64)
        self.capacity = [kind.capacity for kind in types]
        self.carriers = [i for i, kind in enumerate(types) if kind.role is Role.CARRIER]
        self.rovers = [i for i, kind in enumerate(types) if kind.role is Role.ROVER]
        self._carrier_number = {i: k for k, i in enumerate(self.carriers)}
        self._rover_number = {i: k for k, i in enumerate(self.rovers)}
        n_meetings = len(situation.meetings)
        # int64 (robots, meetings): when each could be ready at each meeting by itself; `NEVER` while it is carried
        self.arrive_ms: Times = np.empty((len(types), n_meetings), dtype=np.int64)
        # int64 (carriers, meetings): when a rover could dock at the earliest; a full carrier makes room first
        self.boarding_ms: Times = np.empty((len(self.carriers), n_meetings), dtype=np.int64)
        # int64 (rovers,): the number of the carrier that each rover is aboard, -1 on the ground
        self.aboard: Indices = np.empty(len(self.rovers), dtype=np.int64)
        self._renew(timeline, range(len(types)))

    def advance(self, timeline: Timeline) -> list[int]:
        """Update to a timeline with more actions; return the robots that take part in them."""
        new = timeline.actions[self._seen :]
        changed = sorted({self.row[robot] for action in new for robot in action.robots})
        self._renew(timeline, changed)
        return changed

    def landed(self, v: int) -> Times:
        """Return when a rover aboard would be ready at each meeting if its carrier sets it down there."""
        carrier = self.row[self.timeline.on[self.robots[v]] or ""]
        return np.asarray(self.arrive_ms[carrier] + self.undocking_ms[v])

    def carried(self, k: int, arrive_ms: Times, v: int) -> Times:
        """Return (meetings, meetings): when `v`, at the first at `arrive_ms`, is ready at the second, on `k`."""
        docked = np.maximum(self.boarding_ms[k], arrive_ms) + self.docking_ms[v]
        return np.asarray(docked[:, None] + self.costs.transport[self.kinds[self.carriers[k]]] + self.undocking_ms[v])

    def relay(self, v: int, *, alone: bool = False) -> tuple[Times, dict[int, Transport]]:
        """Return per meeting when a rover could be there, and the last transport on the way (Bellman-Ford).

        Where that is absent it drives there from where it stands. With `alone` no carrier picks it up: it drives, set
        down before by the carrier it is aboard. Exact if no carrier is used twice, an estimate otherwise.
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
                transports[int(m)] = Transport(carrier=on, pickup=None, set_down=names[down], then_to=names[m])
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
                    pickup = int(np.argmin(up[:, down]))
                    transports[int(m)] = Transport(
                        carrier=self.robots[c], pickup=names[pickup], set_down=names[down], then_to=names[m]
                    )
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
            if i in self._rover_number:
                self.aboard[self._rover_number[i]] = -1 if on is None else self._carrier_number[self.row[on]]
            else:
                self.boarding_ms[self._carrier_number[i]] = self._boarding(i)

    def _boarding(self, c: int) -> Times:
        """Return when a rover could dock on a carrier at each meeting at the earliest."""
        name = self.robots[c]
        if self.capacity[c] == 0:
            return np.full(self.arrive_ms.shape[1], NEVER, dtype=np.int64)
        if not self.timeline.is_full(name):
            return self.arrive_ms[c]
        return np.asarray(self.arrive_ms[c] + self.undocking_ms[self.row[self.timeline.cargo[name][0]]])
