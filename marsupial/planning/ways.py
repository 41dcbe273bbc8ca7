"""All ways in which one more target could be explored after a timeline, with the time each would be done.

A robot on the ground goes itself; a carrier sets down a rover it carries at a meeting; or a carrier first picks up a
rover on the ground at one meeting (a full one sets down another there) and carries it to a second. These are one
table over ways and targets, filled by numpy and mended after each step where robots have changed. A rover that needs
several rides in a row is a fourth way, found by a search of its own (`relay`) since it is rarely needed.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from marsupial.model.plan import EPSILON_MS
from marsupial.model.robots import Role
from marsupial.model.situation import UNREACHABLE, PlanningType, Situation
from marsupial.planning.rides import Ride
from marsupial.planning.timeline import Timeline

Times = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
NEVER = 1 << 56
"""Any time from here on means that it can't be done; a dozen of them can be added without overflow."""


class Costs:
    """Durations of driving, as they will stand in actions: at least 1 ms, `NEVER` without a path.

    Attributes
    ----------
    explore, meet
        Per type (places, targets) and (places, meetings).
    stay
        Per type (meetings, meetings): from being ready at one to being ready at another, 0 on the diagonal.
    ride
        The same for carriers, `NEVER` on the diagonal: riding nowhere is of no use.
    """

    def __init__(self, situation: Situation) -> None:
        index = situation.place_index
        meetings = np.array([index[name] for name in situation.meetings], dtype=np.intp)
        targets = np.array([index[target.name] for target in situation.targets], dtype=np.intp)
        self.meetings = meetings
        self.explore: dict[str, Times] = {}
        self.meet: dict[str, Times] = {}
        self.stay: dict[str, Times] = {}
        self.ride: dict[str, Times] = {}
        for kind in situation.types:
            table = situation.travel_ms[kind.name]
            drive = np.where(table == UNREACHABLE, NEVER, np.maximum(table, 1))
            may = np.array([kind.name in target.explorers for target in situation.targets], dtype=np.bool_)
            self.explore[kind.name] = np.where(may, drive[:, targets], NEVER)
            self.meet[kind.name] = drive[:, meetings]
            between = drive[np.ix_(meetings, meetings)] + EPSILON_MS
            self.stay[kind.name], self.ride[kind.name] = between, between.copy()
            np.fill_diagonal(self.stay[kind.name], 0)
            np.fill_diagonal(self.ride[kind.name], NEVER)


class Ways:
    """The table of ways, kept up to date with a timeline; `left` are the targets still in it.

    Attributes
    ----------
    done_ms
        int64 (ways, targets): when the target would be explored, or `NEVER`. Rows: robots alone; rovers set down by
        the carrier they are aboard; then carriers x rovers, the carrier fetching the rover.
    """

    def __init__(self, timeline: Timeline, costs: Costs, left: Mask) -> None:
        situation = timeline.situation
        self.timeline, self.costs = timeline, costs
        self.robots = [robot.name for robot in situation.robots]
        self.kinds: list[PlanningType] = [situation.type_of(name) for name in self.robots]
        self.carriers = [i for i, kind in enumerate(self.kinds) if kind.role is Role.CARRIER]
        self.rovers = [i for i, kind in enumerate(self.kinds) if kind.role is Role.ROVER]
        self.n_targets, n_meetings = len(situation.targets), len(situation.meetings)
        n, c, v = len(self.robots), len(self.carriers), len(self.rovers)
        self.done_ms = np.full((n + v + c * v, self.n_targets), NEVER, dtype=np.int64)
        self._alone = self.done_ms[:n]
        self._deliver = self.done_ms[n : n + v]
        self._fetch = self.done_ms[n + v :].reshape(c, v, self.n_targets)
        self.arrive_ms = np.full((n, n_meetings), NEVER, dtype=np.int64)
        self.left = left.copy()
        self._boarding_ms = np.full((c, n_meetings), NEVER, dtype=np.int64)
        rides = [costs.ride[self.kinds[i].name] for i in self.carriers]
        self._rides = np.array(rides, dtype=np.int64).reshape(c, n_meetings, n_meetings)
        self._outings: dict[str, Times] = {}
        self._note_left()
        self.update(self.robots)

    def explored(self, target: int) -> None:
        """Take a target off the table."""
        self.left[target] = False
        self.done_ms[:, target] = NEVER
        self._note_left()

    def update(self, changed: Iterable[str]) -> None:
        """Mend the table after the timeline has changed for these robots."""
        names = set(changed)
        rows = [i for i, name in enumerate(self.robots) if name in names]
        carriers = [k for k, i in enumerate(self.carriers) if self.robots[i] in names]
        grounded = [k for k, i in enumerate(self.rovers) if self.timeline.on[self.robots[i]] is None]
        for i in rows:
            self._update_robot(i)
        for k in carriers:
            self._boarding_ms[k] = self._boarding(self.carriers[k])
        if not len(self._columns):
            return
        for k, i in enumerate(self.rovers):
            if self.robots[i] in names or self.timeline.on[self.robots[i]] in names:
                self._update_deliver(k)
        for k, i in enumerate(self.rovers):
            if self.robots[i] in names:
                self._update_fetched(k)
        self._update_fetchers(carriers, [k for k in grounded if self.robots[self.rovers[k]] not in names])

    def way(self, row: int) -> tuple[str, str | None]:
        """Return the explorer of a row of the table, and the carrier that brings it, None where it goes itself."""
        n, v = len(self.robots), len(self.rovers)
        if row < n:
            return self.robots[row], None
        if row < n + v:
            rover = self.robots[self.rovers[row - n]]
            return rover, self.timeline.on[rover]
        carrier, k = divmod(row - n - v, v)
        return self.robots[self.rovers[k]], self.robots[self.carriers[carrier]]

    def journey(self, rover: str, carrier: str, target: int) -> Ride:
        """Return how `carrier` best brings `rover` to where it sets out for the target."""
        v, c = self.robots.index(rover), self.robots.index(carrier)
        explore = self.costs.explore[self.kinds[v].name][self.costs.meetings, target]
        names = self.timeline.situation.meetings
        if self.timeline.on[rover] == carrier:
            place = names[int(np.argmin(self._landed(v) + explore))]
            return Ride(carrier=carrier, pickup=None, set_down=place, then_to=place)
        via = self._carried(self.carriers.index(c), self.arrive_ms[v], v)
        first, second = np.unravel_index(int(np.argmin(via + explore)), via.shape)
        return Ride(carrier=carrier, pickup=names[first], set_down=names[second], then_to=names[second])

    def relay(self, rover: str, *, alone: bool = False) -> tuple[Times, dict[int, Ride]]:
        """Search the earliest times at which a rover could be at each meeting with any number of rides.

        With `alone` no carrier fetches it: it drives, set down before by the carrier it is aboard.

        Returns
        -------
        times, rides
            Per meeting the time, and the last ride on the way there (absent: it drives there from where it stands).
            Exact if no carrier is used twice, an estimate otherwise.
        """
        v = self.robots.index(rover)
        names, stay = self.timeline.situation.meetings, self.costs.stay[self.kinds[v].name]
        rides: dict[int, Ride] = {}
        on, times = self.timeline.on[rover], np.minimum(self.arrive_ms[v], NEVER)
        if on is not None:
            via = self._landed(v)[:, None] + stay
            for m in np.flatnonzero(via.min(axis=0, initial=NEVER) < NEVER):
                down = int(np.argmin(via[:, m]))
                rides[int(m)] = Ride(carrier=on, pickup=None, set_down=names[down], then_to=names[m])
                times[m] = via[down, m]
        better = not alone
        while better:
            better = False
            for k, c in enumerate(self.carriers):
                up = self._carried(k, times, v)
                landed = up.min(axis=0, initial=NEVER)[:, None] + stay
                for m in np.flatnonzero(landed.min(axis=0, initial=NEVER) < times):
                    down = int(np.argmin(landed[:, m]))
                    pickup = int(np.argmin(up[:, down]))
                    rides[int(m)] = Ride(
                        carrier=self.robots[c], pickup=names[pickup], set_down=names[down], then_to=names[m]
                    )
                    times[m] = landed[down, m]
                    better = True
        return times, rides

    def _update_robot(self, i: int) -> None:
        name, kind = self.robots[i], self.kinds[i].name
        at, ready = self.timeline.at[name], self.timeline.ready_ms[name]
        if at is None:
            self.arrive_ms[i] = NEVER
            self._alone[i] = NEVER
            return
        place = self.timeline.situation.place_index[at]
        self.arrive_ms[i] = ready + self.costs.meet[kind][place] + EPSILON_MS
        self.arrive_ms[i, self.costs.meetings == place] = ready
        self._alone[i] = np.where(self.left, ready + self.costs.explore[kind][place], NEVER)

    def _update_deliver(self, k: int) -> None:
        v = self.rovers[k]
        self._deliver[k] = NEVER
        if self.timeline.on[self.robots[v]] is not None:
            done = self._landed(v)[:, None] + self._outings[self.kinds[v].name]
            self._deliver[k, self.left] = done.min(axis=0, initial=NEVER)

    def _update_fetched(self, k: int) -> None:
        """Mend the rows of all carriers fetching one rover."""
        v = self.rovers[k]
        self._fetch[:, k] = NEVER
        if self.timeline.on[self.robots[v]] is None:
            self._fetch[:, k, self._columns] = self._fetched(self._boarding_ms, self.arrive_ms[v], self._rides, v)

    def _update_fetchers(self, carriers: list[int], rovers: list[int]) -> None:
        """Mend the rows of these carriers fetching these rovers, all on the ground."""
        for kind in {self.kinds[self.rovers[k]].name for k in rovers}:
            same = np.array([k for k in rovers if self.kinds[self.rovers[k]].name == kind])
            arrive = self.arrive_ms[np.array(self.rovers)[same]]
            for c in carriers:
                done = self._fetched(self._boarding_ms[c], arrive, self._rides[c], self.rovers[same[0]])
                self._fetch[c, same[:, None], self._columns] = done

    def _fetched(self, boarding: Times, arrive: Times, rides: Times, v: int) -> Times:
        """Return (n, targets left): when each would be done by a rover like `v` carried from a meeting to another.

        One of `boarding` and `arrive` is (n, meetings), the other one row; `rides` is for each or for all.
        """
        docked = np.maximum(boarding, arrive) + self._dock_ms(v)
        landed = (docked[:, :, None] + rides).min(axis=1, initial=NEVER) + self._undock_ms(v)
        return np.asarray((landed[:, :, None] + self._outings[self.kinds[v].name]).min(axis=1, initial=NEVER))

    def _carried(self, k: int, arrive: Times, v: int) -> Times:
        """Return (meetings, meetings): when `v`, at meetings at times `arrive`, is carried from one to another."""
        docked = np.maximum(self._boarding_ms[k], arrive) + self._dock_ms(v)
        return docked[:, None] + self._rides[k] + self._undock_ms(v)

    def _note_left(self) -> None:
        """Keep, per type, the costs (meetings, targets left) of exploring from a meeting."""
        self._columns = np.flatnonzero(self.left)
        rows = self.costs.meetings[:, None]
        self._outings = {name: table[rows, self._columns] for name, table in self.costs.explore.items()}

    def _landed(self, v: int) -> Times:
        """Return when a rover that is aboard would be ready at each meeting, set down by its carrier."""
        name = self.robots[v]
        carrier = self.robots.index(self.timeline.on[name] or "")
        return np.maximum(self.arrive_ms[carrier], self.timeline.ready_ms[name]) + self._undock_ms(v)

    def _boarding(self, c: int) -> Times:
        """Return from when a rover could dock on a carrier at each meeting: a full one makes room first."""
        name = self.robots[c]
        if self.kinds[c].capacity == 0:
            return np.full(len(self.costs.meetings), NEVER, dtype=np.int64)
        if not self.timeline.is_full(name):
            return self.arrive_ms[c]
        return self.arrive_ms[c] + self._undock_ms(self.robots.index(self.timeline.cargo[name][0]))

    def _dock_ms(self, v: int) -> int:
        return max(1, self.kinds[v].dock_ms) + EPSILON_MS

    def _undock_ms(self, v: int) -> int:
        return max(1, self.kinds[v].undock_ms) + EPSILON_MS
