"""Simulated annealing over event lists: changes are made on a copy and accepted with Metropolis' rule.

What steers the search is a blend of the parts of a score; what is kept as the best is decided by the parts in turn.
The blend matters: with the makespan alone all robots but the last one would drift.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from marsupial.planning.anytime.encoding import Ints, Task
from marsupial.planning.anytime.kernel import DRIVING, LONGEST_SEGMENT, MAKESPAN, REACHING, Search, draw, schedule
from marsupial.planning.anytime.moves import MOVES, NEEDING_TARGETS, change

SHARES = (30, 50, 58, 66, 76, 88, 92, 98, 100)
"""Of a hundred moves, how many have this number or a lower one."""

SEED = 0x9E3779B97F4A7C15

STEP = 1000
"""Changes tried between two looks at the clock."""

HOT, COLD = 0.02, 0.0003
"""Temperature at the beginning and the end, as a share of the first plan's makespan."""

REACHING_SHARE, DRIVING_SHARE = 0.1, 1e-4
"""What a ms of the mean time at which targets are reached, and a ms of driving, cost beside one of the makespan."""

Score = tuple[int, int, int]


def search_from(task: Task, events: Ints) -> Search:
    """Return a search that begins at a feasible list of events."""
    robots, places = len(task.type_of), task.leg.shape[1]
    room = len(events) + robots + 6 * len(task.targets) + 4 * LONGEST_SEGMENT
    lists = np.zeros((3, room, 4), dtype=np.int32)
    lists[:, : len(events)] = events
    return Search(
        lists=lists,
        sizes=np.full(3, len(events), dtype=np.int64),
        scores=np.zeros((3, 3), dtype=np.int64),
        where=np.zeros(robots, dtype=np.int64),
        on=np.zeros(robots, dtype=np.int64),
        ready=np.zeros(robots, dtype=np.int64),
        load=np.zeros(robots, dtype=np.int64),
        reached=np.zeros((2, places), dtype=np.int64),
        held=np.zeros(LONGEST_SEGMENT, dtype=np.int32),
        seed=np.array([SEED], dtype=np.uint64),
        counts=np.zeros((2, MOVES), dtype=np.int64),
    )


@njit(cache=True, nogil=True)
def anneal(task: Task, search: Search, shares: Ints, blend: Ints, temperature: float, rounds: int) -> float:
    """Try that many changes to the current list; return the cost of the one that is current then.

    `blend` is float64 (3,): what a ms of each part of a score costs. Costs and `temperature` are in ms.
    """
    cost = schedule(task, search, 0, np.inf, blend)
    room = search.lists.shape[1] - 2 * LONGEST_SEGMENT
    for _ in range(rounds):
        _copy(search, 0, 1)
        lot, move = draw(search.seed, 100), 0
        while lot >= shares[move]:
            move += 1
        if move < NEEDING_TARGETS and not len(task.targets):
            continue
        search.counts[0, move] += 1
        if not change(task, search, move) or search.sizes[1] > room:
            continue
        limit = cost - temperature * math.log((draw(search.seed, 1 << 30) + 1) / (1 << 30))
        found = schedule(task, search, 1, limit, blend)
        if found <= limit:
            search.counts[1, move] += 1
            cost = found
            _copy(search, 1, 0)
            search.reached[0] = search.reached[1]
            if _better(search.scores[0], search.scores[2]):
                _copy(search, 0, 2)
    return cost


@njit(cache=True, nogil=True)
def _copy(search: Search, origin: int, to: int) -> None:
    search.sizes[to] = search.sizes[origin]
    for k in range(3):
        search.scores[to, k] = search.scores[origin, k]
    for i in range(search.sizes[origin]):
        for k in range(4):
            search.lists[to, i, k] = search.lists[origin, i, k]


@njit(cache=True, nogil=True)
def _better(one: Ints, other: Ints) -> bool:
    for part in (MAKESPAN, REACHING, DRIVING):
        if one[part] != other[part]:
            return one[part] < other[part]
    return False


class Annealing:
    """A search whose temperature falls as its budget is used up.

    Parameters
    ----------
    events
        A feasible list of events to begin with.
    """

    def __init__(self, task: Task, events: Ints) -> None:
        self._task = task
        self._search = search_from(task, events)
        self._shares = np.array(SHARES, dtype=np.int64)
        self._blend = np.array([1.0, REACHING_SHARE / max(1, int(task.weight.sum())), DRIVING_SHARE], dtype=np.float64)
        self.feasible = bool(np.isfinite(schedule(task, self._search, 2, np.inf, self._blend)))
        self._search.scores[:2] = self._search.scores[2]
        self._scale_ms = float(self._search.scores[2, MAKESPAN])

    @property
    def score(self) -> Score:
        """The score of the best list: see `MAKESPAN`."""
        makespan, reaching, driving = (int(part) for part in self._search.scores[2])
        return makespan, reaching, driving

    @property
    def events(self) -> Ints:
        """The best list so far."""
        return self._search.lists[2, : self._search.sizes[2]].copy()

    def step(self, used: float) -> None:
        """Try `STEP` changes; `used` is the share of the budget used so far, from 0 to 1."""
        temperature = self._scale_ms * HOT * (COLD / HOT) ** used
        anneal(self._task, self._search, self._shares, self._blend, temperature, STEP)
