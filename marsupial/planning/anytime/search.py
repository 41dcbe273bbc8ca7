"""Simulated annealing over event lists: changes are made on a copy and accepted with Metropolis' rule.

What steers the search is a blend of the parts of a score; what is kept as the best is decided by the parts in turn.

What was tried, on nine generated teams of 4 to 136 robots, at most three seeds each: only large differences mean much.
A run gets stuck where it froze, however long it is: a dozen short ones, then one from their best, made plans 1 to 2 %
shorter in all than one long run of the same length. For 150 targets one run takes all of a second, has to begin cooler
and, cut short, gets shorter plans by minding the mean time more than the makespan, which few changes touch. No
difference beyond chance: weighing late targets more (fourth powers of their times), two changes at once, rovers that
change parts for a while only, restarts twice to ten times hotter, other shares of the moves. Not counting references
to arrays made a schedule of a small team about ten times faster, of the largest one about a third.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from marsupial.planning.anytime.encoding import TARGETS, Ints, Task
from marsupial.planning.anytime.kernel import (
    BEST,
    CANDIDATE,
    CURRENT,
    DRIVING,
    LONGEST_SEGMENT,
    MAKESPAN,
    REACHING,
    SIZE,
    Search,
    compiled,
    draw,
    schedule,
)
from marsupial.planning.anytime.moves import NEEDING_TARGETS, change

SHARES = (30, 50, 58, 66, 76, 88, 92, 98, 100)
"""Of a hundred moves, how many have this number or a lower one."""

SEED = 0x9E3779B97F4A7C15

STEP = 1000
"""Changes tried between two looks at the clock."""

HOT, CROWDED, COLD = 0.005, 0.15, 0.0002
"""Temperature at the beginning, that times the number of targets where there are many, and at the end: as shares of the
first plan's makespan."""

RUNS, RUN_CHANGES, RUNS_SHARE = 12, 1500, 0.6
"""How many runs there are at most, how many changes per target each has at least, their share of the budget."""

REACHING_SHARE, REACHING_CROWDED, DRIVING_SHARE = 0.2, 0.02, 1e-4
"""What a ms of the mean time at which targets are reached costs beside one of the makespan, or per target where there
are many, and a ms of driving."""

Score = tuple[int, int, int]


def search_from(task: Task, events: Ints) -> Search:
    """Return a search that begins at a feasible list of events."""
    robots, places = len(task.robots), task.leg.shape[1]
    room = len(events) + robots + 6 * task.groups[TARGETS, 0] + 4 * LONGEST_SEGMENT
    lists = np.zeros((4, room, 4), dtype=np.int32)
    lists[:, : len(events)] = events
    tallies = np.zeros((3, 4), dtype=np.int64)
    tallies[:, SIZE] = len(events)
    return Search(
        lists=lists,
        tallies=tallies,
        state=np.zeros((robots, 4), dtype=np.int64),
        reached=np.zeros((2, places), dtype=np.int64),
        seed=np.array([SEED], dtype=np.uint64),
    )


@njit(cache=True, nogil=True)
def anneal(task: Task, search: Search, shares: Ints, blend: Ints, temperature: float, rounds: int) -> float:
    """Try that many changes to the current list; return the cost of the one that is current then.

    `blend` is float64 (3,): what a ms of each part of a score costs. Costs and `temperature` are in ms.
    """
    cost = schedule(task, search, CURRENT, np.inf, blend)
    room = search.lists.shape[1] - 2 * LONGEST_SEGMENT
    for _ in range(rounds):
        _copy(search, CURRENT, CANDIDATE)
        lot, move = draw(search.seed, 100), 0
        while lot >= shares[move]:
            move += 1
        if move < NEEDING_TARGETS and not task.groups[TARGETS, 0]:
            continue
        if not change(task, search, move) or search.tallies[CANDIDATE, SIZE] > room:
            continue
        limit = cost - temperature * math.log((draw(search.seed, 1 << 30) + 1) / (1 << 30))
        found = schedule(task, search, CANDIDATE, limit, blend)
        if found <= limit:
            cost = found
            _copy(search, CANDIDATE, CURRENT)
            search.reached[CURRENT] = search.reached[CANDIDATE]
            if _better(search.tallies[CURRENT], search.tallies[BEST]):
                _copy(search, CURRENT, BEST)
    return cost


@compiled
def _copy(search: Search, origin: int, to: int) -> None:
    for k in range(4):
        search.tallies[to, k] = search.tallies[origin, k]
    for i in range(search.tallies[origin, SIZE]):
        for k in range(4):
            search.lists[to, i, k] = search.lists[origin, i, k]


@compiled
def _better(one: Ints, other: Ints) -> bool:
    for part in (MAKESPAN, REACHING, DRIVING):
        if one[part] != other[part]:
            return one[part] < other[part]
    return False


class Annealing:
    """A search in a few runs from the same beginning and a last one from the best list that they have found.

    Parameters
    ----------
    events
        A list of events to begin with; if it is not `feasible`, nothing else may be asked.
    """

    def __init__(self, task: Task, events: Ints) -> None:
        self._task, self._beginning = task, events
        self._search = search_from(task, events)
        self._shares = np.array(SHARES, dtype=np.int64)
        targets = int(task.groups[TARGETS, 0])
        reaching = max(REACHING_SHARE, REACHING_CROWDED * targets) / max(1, int(task.worth.sum()))
        self._blend = np.array([1.0, reaching, DRIVING_SHARE], dtype=np.float64)
        self.feasible = bool(np.isfinite(anneal(task, self._search, self._shares, self._blend, 0.0, 0)))
        self._search.tallies[:] = self._search.tallies[CURRENT]
        self._scale_ms = float(self._search.tallies[BEST, MAKESPAN])
        self._hot = max(COLD, min(HOT, CROWDED / max(1, targets)))
        self._runs, self._run = 1, 0

    @property
    def score(self) -> Score:
        """The score of the best list: see `MAKESPAN`."""
        makespan, reaching, driving = (int(part) for part in self._search.tallies[BEST, :SIZE])
        return makespan, reaching, driving

    @property
    def events(self) -> Ints:
        """The best list so far."""
        return self._search.lists[BEST, : self._search.tallies[BEST, SIZE]].copy()

    def expect(self, steps: float) -> None:
        """Choose the number of runs for a budget of about that many steps."""
        enough = RUN_CHANGES * max(1, int(self._task.groups[TARGETS, 0]))
        runs = int(min(float(RUNS), RUNS_SHARE * steps * STEP / enough))
        self._runs = runs + 1 if runs > 1 else 1

    def step(self, used: float) -> None:
        """Try `STEP` changes; `used` is the share of the budget used so far, from 0 to 1."""
        run, fallen, hot = self._moment(used)
        if run != self._run:
            self._run = run
            self._begin_at(self._beginning if run < self._runs - 1 else self.events)
        temperature = self._scale_ms * hot * (COLD / hot) ** fallen
        anneal(self._task, self._search, self._shares, self._blend, temperature, STEP)

    def _moment(self, used: float) -> tuple[int, float, float]:
        """Return which run it is, how far its temperature has fallen (0 to 1), and from where."""
        first = self._runs - 1
        if not first:
            return 0, used, self._hot
        if used >= RUNS_SHARE:
            return first, (used - RUNS_SHARE) / (1 - RUNS_SHARE), max(COLD, 0.4 * self._hot)
        turn = used / RUNS_SHARE * first
        run = min(int(turn), first - 1)
        return run, turn - run, self._hot

    def _begin_at(self, events: Ints) -> None:
        self._search.lists[CURRENT, : len(events)] = events
        self._search.tallies[CURRENT, SIZE] = len(events)
