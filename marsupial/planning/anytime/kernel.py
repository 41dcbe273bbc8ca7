"""The compiled core: event lists and their exact schedules.

One pass over a list gives its schedule: where each robot is, on whom, from when it is ready, how full each carrier
is. The pass ends as soon as the list is seen to be impossible or too long. Rovers' targets stand right behind where
the rover was set down (only the order of its own events counts), so that rides can be moved about without tearing a
rover's outing apart.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from marsupial.planning.anytime.encoding import (
    ABOARD,
    AT,
    CAPACITY,
    DOCK,
    DOCKING,
    EXPLORE,
    HOME,
    NEVER,
    READY,
    ROVERS,
    START,
    TYPE,
    UNDOCK,
    UNDOCKING,
    Ints,
    Task,
)

compiled = njit(cache=True, nogil=True, _nrt=False)
"""For functions that only compiled functions call and that make no arrays: nobody counts references to those passed."""

LONGEST_SEGMENT = 8
"""How many targets are moved at once at most."""

MAKESPAN, REACHING, DRIVING, SIZE = 0, 1, 2, 3
"""Parts of a score: ms until the end, weighted sum of the times targets are reached, ms of driving. Then the length."""

CURRENT, CANDIDATE, BEST, TAKEN = 0, 1, 2, 3
"""Lists of a search."""

WHERE, ON, READY_AT, LOAD = 0, 1, 2, 3
"""Columns of the state of robots."""


class Search(NamedTuple):
    """What a search remembers between calls: few arrays, for each of them costs time in every compiled call.

    Attributes
    ----------
    lists
        int32 (4, room, 4): the current list of events, the candidate, the best; of the last one only the first column
        is used, for the targets `TAKEN` out of the candidate.
    tallies
        int64 (3, 4): the scores of the lists, and their lengths.
    state
        int64 (robots, 4), scratch of `schedule`.
    reached
        int64 (2, places): when the current list and the candidate reach each place that is a target.
    seed
        uint64 (1,): state of the random numbers.
    """

    lists: Ints
    tallies: Ints
    state: Ints
    reached: Ints
    seed: Ints


@compiled
def draw(seed: Ints, n: int) -> Any:
    """Return a random number from 0 to n - 1 (xorshift)."""
    x = seed[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    seed[0] = x
    return np.int64(x >> np.uint64(33)) % n


@compiled
def pick(task: Task, search: Search, group: int) -> Any:
    """Return a random member of a group that has any."""
    return task.groups[group, 1 + draw(search.seed, task.groups[group, 0])]


@compiled
def schedule(task: Task, search: Search, which: int, limit: float, blend: Ints) -> float:
    """Return the cost of a list, and enter its score; inf where it can't be carried out or costs more than `limit`.

    The carriers of its undocks are entered in the list as well.
    """
    events, size, reached = search.lists[which], search.tallies[which, SIZE], search.reached[min(which, 1)]
    state = search.state
    for i in range(len(state)):
        state[i, WHERE], state[i, ON] = task.robots[i, AT], task.robots[i, ABOARD]
        state[i, READY_AT], state[i, LOAD] = task.robots[i, READY], 0
    for i in range(len(state)):
        if state[i, ON] >= 0:
            state[state[i, ON], LOAD] += 1
    makespan, reaching, driving = 0, 0, 0
    for i in range(size):
        kind, robot, place = events[i, 0], events[i, 1], events[i, 3]
        if kind == START:
            continue
        carrier = events[i, 2] if kind == DOCK else state[robot, ON]
        if kind != UNDOCK:
            if state[robot, ON] >= 0:
                return np.inf
            leg = task.leg[task.robots[robot, TYPE], state[robot, WHERE], place]
            if leg >= NEVER:
                return np.inf
            state[robot, READY_AT] += leg
            driving += leg
            state[robot, WHERE] = place
        if kind != EXPLORE:
            if carrier < 0:
                return np.inf
            leg = task.leg[task.robots[carrier, TYPE], state[carrier, WHERE], place]
            if leg >= NEVER:
                return np.inf
            driving += leg
            begin = max(state[carrier, READY_AT] + leg, state[robot, READY_AT])
            if kind == DOCK:
                if state[carrier, LOAD] >= task.robots[carrier, CAPACITY]:
                    return np.inf
                state[carrier, LOAD] += 1
                state[robot, ON] = carrier
                state[robot, READY_AT] = begin + task.robots[robot, DOCKING]
            else:
                state[carrier, LOAD] -= 1
                state[robot, ON] = -1
                state[robot, WHERE] = place
                state[robot, READY_AT] = begin + task.robots[robot, UNDOCKING]
                events[i, 2] = carrier
            state[carrier, READY_AT], state[carrier, WHERE] = state[robot, READY_AT], place
        else:
            reached[place] = state[robot, READY_AT]
            reaching += task.worth[place] * state[robot, READY_AT]
        if state[robot, READY_AT] > makespan:
            makespan = state[robot, READY_AT]
            if makespan > limit:
                return np.inf
    return _finish(task, search, which, blend, makespan, reaching, driving)


@compiled
def _finish(task: Task, search: Search, which: int, blend: Ints, makespan: int, reaching: int, driving: int) -> float:
    """Add the way home, enter the score and return the cost; inf where a rover is left on the ground."""
    if task.recover:
        for i in task.groups[ROVERS, 1 : 1 + task.groups[ROVERS, 0]]:
            if search.state[i, ON] < 0:
                return np.inf
    for i in range(len(task.robots)):
        if task.robots[i, HOME] >= 0 and search.state[i, WHERE] != task.robots[i, HOME]:
            leg = task.leg[task.robots[i, TYPE], search.state[i, WHERE], task.robots[i, HOME]]
            if leg >= NEVER:
                return np.inf
            makespan = max(makespan, search.state[i, READY_AT] + leg)
            driving += leg
    search.tallies[which, MAKESPAN] = makespan
    search.tallies[which, REACHING] = reaching
    search.tallies[which, DRIVING] = driving
    return blend[MAKESPAN] * makespan + blend[REACHING] * reaching + blend[DRIVING] * driving


@compiled
def insert(search: Search, at: int, kind: int, robot: int, carrier: int, place: int) -> None:
    """Insert an event into the candidate."""
    events, size = search.lists[1], search.tallies[1, SIZE]
    for i in range(size, at, -1):
        for k in range(4):
            events[i, k] = events[i - 1, k]
    events[at, 0], events[at, 1], events[at, 2], events[at, 3] = kind, robot, carrier, place
    search.tallies[1, SIZE] = size + 1


@compiled
def erase(search: Search, at: int, count: int) -> None:
    """Take events out of the candidate."""
    events, size = search.lists[1], search.tallies[1, SIZE] - count
    for i in range(at, size):
        for k in range(4):
            events[i, k] = events[i + count, k]
    search.tallies[1, SIZE] = size


@compiled
def outing_end(task: Task, search: Search, at: int) -> int:
    """Return the index after the targets that stand behind event `at` and belong to the same rover."""
    events = search.lists[1]
    robot, end = events[at, 1], at + 1
    while end < search.tallies[1, SIZE] and events[end, 0] == EXPLORE and events[end, 1] == robot:
        end += 1
    return end


@compiled
def next_event(search: Search, at: int, robot: int) -> int:
    """Return the index of the next event of a rover after index `at`, -1 if there is none."""
    events = search.lists[1]
    for i in range(at + 1, search.tallies[1, SIZE]):
        if events[i, 1] == robot:
            return i
    return -1


@compiled
def after_carrier(task: Task, search: Search, carrier: int, first: int, end: int) -> int:
    """Return an index to insert at: after `first`, or after a random event of a carrier between there and `end`."""
    events, chosen, seen = search.lists[1], first, 1
    for i in range(first + 1, end):
        if events[i, 2] == carrier or events[i, 1] == carrier:
            seen += 1
            if draw(search.seed, seen) == 0:
                chosen = i
    return outing_end(task, search, chosen)


@compiled
def door(search: Search, doors: Ints) -> int:
    """Return one of a few meetings, the first ones more often; -1 if there is none."""
    count = 0
    while count < len(doors) and doors[count] >= 0:
        count += 1
    return doors[min(draw(search.seed, count), draw(search.seed, count))] if count else -1


@compiled
def find(search: Search, place: int) -> int:
    """Return the index of the event that explores a target, -1 if there is none."""
    events = search.lists[1]
    for i in range(search.tallies[1, SIZE]):
        if events[i, 3] == place and events[i, 0] == EXPLORE:
            return i
    return -1
