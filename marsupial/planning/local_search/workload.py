"""A lower bound on the makespan from the total work: of all rovers together, or of all carriers together.

A *room* is a set of places between which rovers can drive themselves. Where it holds targets that no carrier explores
and no rover stands in it, a rover has to be brought and set down; where rovers have to end aboard, or are fewer than
the rooms, they have to be picked up. This bounds docking and undocking, driving inside of rooms, and driving between
them: no less than a spanning forest of the rooms that grows from where the robots are. Robots that share this work
evenly and finish together finish no later than those of any plan. Shortest paths may lead through any place and use the
quickest type, so the bound assumes nothing about travel tables.
"""

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.schedule.costs import NEVER

MOST_PLACES = 400  # with more there is no such bound: shortest ways between so many already take 0.1 s

AT_ONCE_MS = 1e-6  # a path of no cost; scipy would treat less than 1e-8 as no path


def work_bound_ms(data: ProblemData) -> int:
    """Return a time before which the robots can't all be ready; 0 where nothing has to be shared among rovers."""
    rovers, carriers = data.members(col.ROVERS), data.members(col.CARRIERS)
    if not len(rovers) or not len(carriers) or data.leg.shape[1] > MOST_PLACES:
        return 0
    rooms = _Rooms(data)
    standing = rovers[data.robots[rovers, col.ABOARD] < 0]
    occupied = np.unique(rooms.of[data.robots[standing, col.AT]]).tolist()
    empty = [room for room in rooms.targets if room not in occupied]
    downs, aboard = len(empty), len(rovers) - len(standing)
    ups = downs + len(standing) if data.recover else max(0, downs - aboard)
    undocking, docking = data.robots[rovers][:, [col.UNDOCKING, col.DOCKING]].min(axis=0).tolist()
    transfers = downs * undocking + ups * docking
    of_rovers = transfers + rooms.rides_ms(empty) + rooms.ground_ms()
    visited = empty + occupied if data.recover else empty
    lone = [t for t in data.members(col.TARGETS) if np.isinf(rooms.by_rover[:, t]).sum() == len(rooms.of) - 1]
    return max(
        _evenly(transfers + rooms.tours_ms(empty, visited, lone), data.robots[carriers, col.READY]),
        _evenly(of_rovers, data.robots[rovers, col.READY]),
    )


class _Rooms:
    """The rooms of a situation, by number."""

    def __init__(self, data: ProblemData) -> None:
        from scipy.sparse.csgraph import connected_components, floyd_warshall  # most of a mission needs no bound

        legs = np.where(data.leg >= NEVER, np.inf, data.leg)
        rovers, carriers = (np.unique(data.robots[data.members(g), col.TYPE]) for g in (col.ROVERS, col.CARRIERS))
        self._data = data
        # (places, places): ms of the shortest ways with the quickest type of them; inf without one
        self.by_rover, self.by_carrier = (floyd_warshall(legs[kinds].min(axis=0)) for kinds in (rovers, carriers))
        _, self.of = connected_components(np.isfinite(self.by_rover), directed=False)
        self._meetings = data.members(col.MEETINGS)
        # no place counts for itself: the diagonal is 0 wherever a type can stand
        own = (np.isfinite(legs[carriers]) & ~np.eye(legs.shape[1], dtype=np.bool_)).any(axis=(0, 1))
        theirs = [t for t in data.members(col.TARGETS) if not own[t]]
        labels = dict.fromkeys(self.of[theirs].tolist())
        # per room with targets that no carrier explores: these
        self.targets = {room: np.array([t for t in theirs if self.of[t] == room], dtype=np.int64) for room in labels}

    def _meetings_in(self, room: int) -> Ints:
        return self._meetings[self.of[self._meetings] == room]

    def rides_ms(self, rooms: list[int]) -> float:
        """Return how long rovers are carried at least, in total, if each of these rooms needs one."""
        from scipy.sparse.csgraph import floyd_warshall

        data, rovers = self._data, self._data.members(col.ROVERS)
        hosts = data.robots[rovers, col.ABOARD]
        begun = [self._meetings_in(room) for room in np.unique(self.of[data.robots[rovers[hosts < 0], col.AT]])]
        beginnings = np.concatenate([data.robots[hosts[hosts >= 0], col.AT], *begun])
        alike = self.of[:, None] == self.of
        carried = floyd_warshall(np.where(alike, np.minimum(self.by_carrier, AT_ONCE_MS), self.by_carrier))
        groups = [self._meetings_in(room) for room in rooms]
        return _forest(_apart(carried, [beginnings], groups)[0], _apart(carried, groups, groups))

    def tours_ms(self, empty: list[int], visited: list[int], lone: list[int]) -> float:
        """Return how long carriers drive or wait at least, in all, to visit rooms and targets.

        In one of the `empty` rooms a rover is set down and, where rovers have to end aboard, one is picked up:
        meanwhile the carrier waits, or it is visited again.
        """
        data = self._data
        groups = [*(self._meetings_in(room) for room in visited), *(np.array([target]) for target in lone)]
        first = _apart(self.by_carrier, [data.robots[data.members(col.CARRIERS), col.AT]], groups)[0]
        between = _apart(self.by_carrier, groups, groups)
        total = _forest(first, between)
        if data.recover:
            np.fill_diagonal(between, np.inf)
            again = np.minimum(first, between.min(axis=0, initial=np.inf))
            total += sum(min(again[i], self._sortie_ms(room)) for i, room in enumerate(visited) if room in empty)
        return total

    def ground_ms(self) -> float:
        """Return how long rovers drive at least, in total, in rooms with targets; a rover stays in at most one."""
        ways = [self._sorties_ms(room) for room in self.targets]
        backs = sorted(closed - staying for staying, closed in ways)
        left = 0 if self._data.recover else int(self._data.groups[col.ROVERS, 0])
        return sum(staying for staying, _ in ways) + sum(backs[: max(0, len(backs) - left)])

    def _sorties_ms(self, room: int) -> tuple[float, float]:
        """Return how long rovers drive at least in a room with targets, if one stays there and if none does."""
        targets, there = self.targets[room], self._there_ms(room)
        singles = [targets[i : i + 1] for i in range(len(targets))]
        spanning = _forest(there, _apart(self.by_rover, singles, singles))
        return max(spanning, float(there.max())), max(spanning, self._sortie_ms(room))

    def _sortie_ms(self, room: int) -> float:
        """Return how long the rover that explores the farthest target of a room is on its way there and to a door."""
        back = self.by_rover[np.ix_(self.targets[room], self._meetings_in(room))].min(axis=1, initial=np.inf)
        return float((self._there_ms(room) + back).max())

    def _there_ms(self, room: int) -> Floats:
        """Return how long the ways are to the targets of a room, from where rovers can be first on its ground."""
        starts = self._data.robots[self._data.members(col.ROVERS), col.AT]
        entries = np.concatenate([self._meetings_in(room), starts[(starts >= 0) & (self.of[starts] == room)]])
        ways: Floats = self.by_rover[np.ix_(entries, self.targets[room])].min(axis=0, initial=np.inf)
        return ways


def _forest(least: Floats, between: Floats) -> float:
    """Return the length of a shortest forest (Prim) that joins points to roots, which are at `least` (points,)."""
    between = np.minimum(between, between.T)
    total, left = 0.0, np.ones(len(least), dtype=np.bool_)
    while left.any():
        nearest = int(np.argmin(np.where(left, least, np.inf)))
        if not left[nearest]:
            return np.inf
        total += least[nearest]
        left[nearest] = False
        least = np.minimum(least, between[nearest])
    return total


def _apart(ways: Floats, some: list[Ints], others: list[Ints]) -> Floats:
    """Return (some, others): how far from the nearest place of a group to one of another group."""
    table = np.full((len(some), len(others)), np.inf)
    rows, columns = ([i for i, group in enumerate(groups) if len(group)] for groups in (some, others))
    if rows and columns:
        one, other = [some[i] for i in rows], [others[i] for i in columns]
        apart = ways[np.ix_(np.concatenate(one), np.concatenate(other))]
        for axis, groups in enumerate((one, other)):
            apart = np.minimum.reduceat(apart, np.cumsum([0, *map(len, groups[:-1])]), axis=axis)
        table[np.ix_(rows, columns)] = apart
    return table


def _evenly(work_ms: float, ready_ms: Ints) -> int:
    """Return when robots that are `ready_ms` finish the work together, evenly shared; 0 if never."""
    if not 0 < work_ms < np.inf:
        return 0
    ready = np.sort(ready_ms)
    counts = np.arange(1, len(ready) + 1)
    done = (work_ms + np.cumsum(ready)) / counts  # by the first, the first two, ...
    return int(done[done >= ready].min())
