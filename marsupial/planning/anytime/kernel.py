"""The compiled core: event lists and their exact schedules.

One pass over a list gives its schedule: where each robot is, on whom, from when it is ready, how full each carrier
is. The pass ends as soon as the list is seen to be impossible or too long. Rovers' targets stand right behind where
the rover was set down (only the order of its own events counts), so that rides can be moved about without tearing a
rover's outing apart.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from marsupial.planning.anytime.encoding import DOCK, EXPLORE, NEVER, START, UNDOCK, Ints, Task

LONGEST_SEGMENT = 8
"""How many targets are moved at once at most."""

MAKESPAN, REACHING, DRIVING = 0, 1, 2
"""Parts of a score: ms until the end, weighted sum of the times targets are reached, ms of driving."""


class Search(NamedTuple):
    """What a search remembers between calls.

    Attributes
    ----------
    lists
        int32 (3, room, 4): the current list of events, the candidate, the best.
    sizes
        int64 (3,): their lengths.
    scores
        int64 (3, 3): their scores.
    where, on, ready, load
        int64 per robot, scratch of `schedule`.
    reached
        int64 (2, places): when the current list and the candidate reach each place that is a target.
    held
        int32 (`LONGEST_SEGMENT`,), scratch: targets taken out of a list.
    seed
        uint64 (1,): state of the random numbers.
    counts
        int64 (2, moves): how often each move was tried and accepted.
    """

    lists: Ints
    sizes: Ints
    scores: Ints
    where: Ints
    on: Ints
    ready: Ints
    load: Ints
    reached: Ints
    held: Ints
    seed: npt.NDArray[Any]
    counts: Ints


@njit(cache=True, nogil=True)
def draw(seed: Ints, n: int) -> Any:
    """Return a random number from 0 to n - 1 (xorshift)."""
    x = seed[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    seed[0] = x
    return np.int64(x >> np.uint64(33)) % n


@njit(cache=True, nogil=True)
def schedule(task: Task, search: Search, which: int, limit: float, blend: Ints) -> float:
    """Return the cost of a list, and enter its score; inf where it can't be carried out or costs more than `limit`.

    The carriers of its undocks are entered in the list as well.
    """
    events, size, reached = search.lists[which], search.sizes[which], search.reached[min(which, 1)]
    where, on, ready, load = search.where, search.on, search.ready, search.load
    for i in range(len(where)):
        where[i], on[i], ready[i], load[i] = task.start[i], task.aboard[i], task.ready[i], 0
    for i in task.rovers:
        if on[i] >= 0:
            load[on[i]] += 1
    makespan, reaching, driving = 0, 0, 0
    for i in range(size):
        kind, robot, place = events[i, 0], events[i, 1], events[i, 3]
        if kind == START:
            continue
        carrier = events[i, 2] if kind == DOCK else on[robot]
        if kind != UNDOCK:
            if on[robot] >= 0:
                return np.inf
            leg = task.leg[task.type_of[robot], where[robot], place]
            if leg >= NEVER:
                return np.inf
            ready[robot] += leg
            driving += leg
            where[robot] = place
        if kind != EXPLORE:
            if carrier < 0:
                return np.inf
            leg = task.leg[task.type_of[carrier], where[carrier], place]
            if leg >= NEVER:
                return np.inf
            driving += leg
            begin = max(ready[carrier] + leg, ready[robot])
            if kind == DOCK:
                if load[carrier] >= task.capacity[carrier]:
                    return np.inf
                load[carrier] += 1
                on[robot] = carrier
                ready[robot] = begin + task.dock[robot]
            else:
                load[carrier] -= 1
                on[robot] = -1
                where[robot] = place
                ready[robot] = begin + task.undock[robot]
                events[i, 2] = carrier
            ready[carrier], where[carrier] = ready[robot], place
        else:
            reached[place] = ready[robot]
            reaching += task.weight[place] * ready[robot]
        if ready[robot] > makespan:
            makespan = ready[robot]
            if makespan > limit:
                return np.inf
    return _finish(task, search, which, blend, makespan, reaching, driving)


@njit(cache=True, nogil=True)
def _finish(task: Task, search: Search, which: int, blend: Ints, makespan: int, reaching: int, driving: int) -> float:
    """Add the way home, enter the score and return the cost; inf where a rover is left on the ground."""
    if task.recover[0]:
        for i in task.rovers:
            if search.on[i] < 0:
                return np.inf
    for i in task.carriers:
        if task.home[i] >= 0 and search.where[i] != task.home[i]:
            leg = task.leg[task.type_of[i], search.where[i], task.home[i]]
            if leg >= NEVER:
                return np.inf
            makespan = max(makespan, search.ready[i] + leg)
            driving += leg
    search.scores[which, MAKESPAN] = makespan
    search.scores[which, REACHING] = reaching
    search.scores[which, DRIVING] = driving
    return blend[MAKESPAN] * makespan + blend[REACHING] * reaching + blend[DRIVING] * driving


@njit(cache=True, nogil=True)
def insert(search: Search, at: int, kind: int, robot: int, carrier: int, place: int) -> None:
    """Insert an event into the candidate."""
    events, size = search.lists[1], search.sizes[1]
    for i in range(size, at, -1):
        for k in range(4):
            events[i, k] = events[i - 1, k]
    events[at, 0], events[at, 1], events[at, 2], events[at, 3] = kind, robot, carrier, place
    search.sizes[1] = size + 1


@njit(cache=True, nogil=True)
def erase(search: Search, at: int, count: int) -> None:
    """Take events out of the candidate."""
    events, size = search.lists[1], search.sizes[1] - count
    for i in range(at, size):
        for k in range(4):
            events[i, k] = events[i + count, k]
    search.sizes[1] = size


@njit(cache=True, nogil=True)
def outing_end(task: Task, search: Search, at: int) -> int:
    """Return the index after the targets that stand behind event `at` and belong to the same rover."""
    events = search.lists[1]
    robot, end = events[at, 1], at + 1
    while end < search.sizes[1] and events[end, 0] == EXPLORE and events[end, 1] == robot:
        end += 1
    return end


@njit(cache=True, nogil=True)
def next_event(search: Search, at: int, robot: int) -> int:
    """Return the index of the next event of a rover after index `at`, -1 if there is none."""
    events = search.lists[1]
    for i in range(at + 1, search.sizes[1]):
        if events[i, 1] == robot:
            return i
    return -1


@njit(cache=True, nogil=True)
def after_carrier(task: Task, search: Search, carrier: int, first: int, end: int) -> int:
    """Return an index to insert at: after `first`, or after a random event of a carrier between there and `end`."""
    events, chosen, seen = search.lists[1], first, 1
    for i in range(first + 1, end):
        if events[i, 2] == carrier or events[i, 1] == carrier:
            seen += 1
            if draw(search.seed, seen) == 0:
                chosen = i
    return outing_end(task, search, chosen)


@njit(cache=True, nogil=True)
def door(search: Search, doors: Ints) -> int:
    """Return one of a few meetings, the first ones more often; -1 if there is none."""
    count = 0
    while count < len(doors) and doors[count] >= 0:
        count += 1
    return doors[min(draw(search.seed, count), draw(search.seed, count))] if count else -1


@njit(cache=True, nogil=True)
def find(search: Search, place: int) -> int:
    """Return the index of the event that explores a target, -1 if there is none."""
    events = search.lists[1]
    for i in range(search.sizes[1]):
        if events[i, 3] == place and events[i, 0] == EXPLORE:
            return i
    return -1
