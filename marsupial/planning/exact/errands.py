"""What carriers at least have to do: errands, each a bit, that are shared among them.

A *room* is all that rovers can drive between: one that is set down stays in the room until it is picked up at one of
its meetings. Every room without a rover and with targets that no carrier explores has to be visited to set one down.
Where rovers have to end aboard, every rover on the ground has to be picked up in its room, and so has the one to be set
down: the last one to be picked up there cannot be aboard before the first one set down had the time to explore a target
of the room. A target that no rover explores has to be visited by a carrier. Each carrier has to be done in time with
the shortest tour over its errands, in which a carrier that both sets down first and picks up last in a room goes
somewhere else in between, or waits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from marsupial.planning.anytime.encoding import (
    CAPACITY,
    DOCKING,
    HOME,
    MEETINGS,
    NEVER,
    ROVERS,
    TARGETS,
    TYPE,
    UNDOCKING,
    Ints,
    Task,
)
from marsupial.planning.anytime.kernel import compiled

BITS = 16
"""How many errands there are at most; what more there may be is left out of account."""

TOURS_BYTES = 1 << 25
"""For tours over sets of errands: there are fewer errands where that is too much."""


class Errands(NamedTuple):
    """Arrays of int64.

    Attributes
    ----------
    room
        (bases,): which row of the following a rover at the base is part of, -1 if none.
    within
        (rows,): the set of targets that make the errands of a row necessary.
    down, up
        (rows,): the bits for setting down or visiting, and for picking up; the same where there are too few.
    rooms
        How many of the rows, the first ones, are rooms; the others are carriers' targets.
    tours
        (n, rovers aboard, bases, sets of errands): ms for a carrier to do them and go home, without the docks and
        undocks that they are.
    like
        (carriers,): the first index of `tours`.
    docking, undocking
        The least ms these take.
    """

    room: Ints
    within: Ints
    down: Ints
    up: Ints
    rooms: int
    tours: Ints
    like: Ints
    docking: int
    undocking: int


def errands_of(task: Task, closure: Ints, bases: Ints, carriers: Ints) -> Errands:
    """Return the errands of a situation; `carriers` are robots of the task."""
    targets, meetings = task.members(TARGETS), task.members(MEETINGS)
    rovers = task.members(ROVERS)
    kinds = sorted({int(k) for k in task.robots[rovers, TYPE]})
    driven = sorted({int(k) for k in task.robots[carriers, TYPE]})
    component = _components(closure[kinds].min(axis=0, initial=NEVER) < NEVER)
    own = (closure[driven][:, bases].min(axis=(0, 1), initial=NEVER) < NEVER)[targets]
    theirs = (closure[kinds][:, bases].min(axis=(0, 1), initial=NEVER) < NEVER)[targets]
    places = np.concatenate([meetings, targets])
    firsts, like = np.unique(task.robots[carriers][:, [TYPE, HOME]], axis=0, return_inverse=True)
    most = np.minimum(task.robots[carriers, CAPACITY], len(rovers))
    loads = 1 + int(most.max(initial=0))
    most_bits = min(BITS, (TOURS_BYTES // max(1, 8 * len(firsts) * loads * len(bases))).bit_length() - 1)
    points: list[Any] = []
    within: list[int] = []
    room = np.full(len(bases), -1, dtype=np.int64)
    labels = list(dict.fromkeys(int(component[m]) for m in meetings))[:most_bits]
    for label in labels:
        room[component[bases] == label] = len(points)
        within.append(sum(1 << j for j, t in enumerate(targets) if component[t] == label and not own[j]))
        points.append((component[places] == label) & (np.arange(len(places)) < len(meetings)))
    for j, t in enumerate(targets):
        if own[j] and not theirs[j] and len(points) < most_bits:
            within.append(1 << j)
            points.append(places == t)
    down = np.arange(len(points))
    up, spare = down.copy(), most_bits - len(points) if task.recover else 0
    up[: min(spare, len(labels))] = len(points) + np.arange(min(spare, len(labels)))
    lag = [
        _least_outing(closure[kinds], places[at], targets[_bits(w, len(targets))])
        for at, w in zip(points, within, strict=True)
    ]
    chosen = np.array(points, dtype=np.bool_).reshape(len(points), len(places))
    places, chosen = places[chosen.any(axis=0)], np.ascontiguousarray(chosen[:, chosen.any(axis=0)])
    bits = int(up.max(initial=-1)) + 1 if task.recover else len(points)
    docking = int(task.robots[rovers, DOCKING].min(initial=NEVER))
    tours = np.full((len(firsts), loads, len(bases), 1 << bits), NEVER, dtype=np.int64)
    for i, (kind, home) in enumerate(firsts):
        places_aboard = int(most[like.reshape(-1) == i][0])
        leg = closure[kind]
        ends = leg[:, home] if home >= 0 else np.zeros(len(leg), dtype=np.int64)
        tours[i, : places_aboard + 1] = errand_tours(
            np.ascontiguousarray(leg[np.ix_(bases, places)]),
            np.ascontiguousarray(leg[np.ix_(places, places)]),
            np.ascontiguousarray(ends[bases]),
            np.ascontiguousarray(ends[places]),
            chosen,
            up,
            np.array(lag, dtype=np.int64),
            bits,
            len(labels),
            task.recover,
            places_aboard,
            docking,
        )
    return Errands(
        room=room,
        within=np.array(within, dtype=np.int64),
        down=down,
        up=up,
        rooms=len(labels),
        tours=tours,
        like=like.reshape(-1).astype(np.int64),
        docking=docking,
        undocking=int(task.robots[rovers, UNDOCKING].min(initial=NEVER)),
    )


def _bits(targets: int, n: int) -> list[int]:
    return [j for j in range(n) if targets >> j & 1]


def _least_outing(closure: Ints, meetings: Ints, targets: Ints) -> int:
    """Return the least ms a rover takes from any of the meetings to a target and back to any of them."""
    if not closure.size:
        return NEVER
    out = closure[:, meetings][:, :, targets].min(axis=1, initial=NEVER)
    back = closure[:, targets][:, :, meetings].min(axis=2, initial=NEVER)
    return min(NEVER, int((out + back).min(initial=NEVER)))


def _components(joined: Any) -> Ints:
    """Return (places,): the least place that each is joined to, over any number of others; `joined` is bool."""
    joined = joined | joined.T
    label = np.arange(len(joined))
    while True:
        lower = np.where(joined, label[None, :], label[:, None]).min(axis=1)
        if np.array_equal(lower, label):
            return label
        label = lower


ANY, LEFT = 0, 1
"""Whether a rover has just been set down where a carrier is, and has to be picked up there."""


@njit(cache=True, nogil=True)
def errand_tours(
    first: Ints,
    between: Ints,
    straight: Ints,
    ends: Ints,
    points: Ints,
    up: Ints,
    lag: Ints,
    bits: int,
    rooms: int,
    recover: bool,
    capacity: int,
    docking: int,
) -> Ints:
    """Return (loads, bases, sets): the shortest tours over errands and to the end with so many rovers aboard at first.

    To set a rover down a carrier needs one aboard: one picked up on an errand, or another one, which costs a dock.

    Parameters
    ----------
    first
        (bases, places): ms from a base to a place.
    between
        (places, places).
    straight, ends
        (bases,) and (places,): ms to the end.
    points
        (rows, places), bool: whether the errands of a row can be done at a place.
    up
        (rows,): the bits for picking up; those for setting down are the numbers of the rows.
    lag
        (rows,): the least ms between setting down and picking up.
    """
    rows, places = points.shape
    rest = np.full((2, capacity + 1, 1 << bits, places), NEVER, dtype=np.int64)
    tours = np.full((capacity + 1, len(first), 1 << bits), NEVER, dtype=np.int64)
    rest[ANY, :, 0] = ends
    tours[:, :, 0] = straight
    for s in range(1, 1 << bits):
        for load in range(capacity, -1, -1):
            for e in range(rows):
                for q in range(places):
                    after = _after(rest, up, rooms, recover, load, s, e, q) if points[e, q] else NEVER
                    if after >= NEVER:
                        continue
                    for p in range(places):
                        rest[ANY, load, s, p] = min(rest[ANY, load, s, p], between[p, q] + after)
                        if not points[e, p]:
                            rest[LEFT, load, s, p] = min(rest[LEFT, load, s, p], between[p, q] + after)
                    for b in range(len(first)):
                        tours[load, b, s] = min(tours[load, b, s], first[b, q] + after)
            if load < capacity:
                for p in range(places):
                    for mode in range(2):
                        rest[mode, load, s, p] = min(rest[mode, load, s, p], rest[mode, load + 1, s, p] + docking)
                for b in range(len(first)):
                    tours[load, b, s] = min(tours[load, b, s], tours[load + 1, b, s] + docking)
        for e in range(rows):
            if up[e] != e and not s >> e & 1 and s >> up[e] & 1:
                _wait(rest, between, points[e], s, 1 << up[e], lag[e], docking)
    return tours


@compiled
def _wait(rest: Ints, between: Ints, points: Ints, errands: int, pick: int, lag: int, docking: int) -> None:
    """Let a carrier that has just set a rover down wait to pick it up; other rovers it can pick up meanwhile."""
    capacity, places = rest.shape[1] - 1, len(points)
    for load in range(capacity + 1):
        for p in range(places):
            for q in range(places):
                if not points[p] or not points[q]:
                    continue
                for more in range(capacity + 1):
                    stay = max(between[p, q], lag, more * docking)
                    stay += rest[ANY, min(capacity, load + 1 + more), errands & ~pick, q]
                    rest[LEFT, load, errands, p] = min(rest[LEFT, load, errands, p], stay)


@compiled
def _after(rest: Ints, up: Ints, rooms: int, recover: bool, load: int, errands: int, row: int, place: int) -> int:
    """Return the ms that errands take from when the first of them is done, one of that row at that place."""
    capacity = rest.shape[1] - 1
    if errands >> row & 1:
        left = errands & ~(1 << row)
        if row >= rooms:
            return rest[ANY, load, left, place]
        if up[row] == row and recover:
            return rest[ANY, capacity, left, place] if capacity > 0 else NEVER
        if load == 0:
            return NEVER
        return rest[LEFT if up[row] != row and left >> up[row] & 1 else ANY, load - 1, left, place]
    if up[row] != row and errands >> up[row] & 1 and capacity > 0:
        return rest[ANY, min(capacity, load + 1), errands & ~(1 << up[row]), place]
    return NEVER


ERRAND, TAKES, TRIED = 0, 1, 2
"""Rows of a list of what is to be done: the number of its bit, ms, the carrier it is given to."""

TOURED, BUSY, ABOARD = 0, 1, 2
"""Rows of loads: the set of errands of each carrier, ms of docks and undocks, rovers aboard or free to be had."""


@compiled
def shared(errands: Errands, state: Ints, jobs: Ints, size: int, loads: Ints, limit: int, tries: int) -> bool:
    """Say whether jobs can be shared among the carriers so that all are done before `limit`; True if it takes long.

    Parameters
    ----------
    jobs
        (3, n): `ERRAND` and so on, those of one bit together.
    loads
        (3, carriers); the last row is given.
    """
    carriers = loads.shape[1]
    for c in range(carriers):
        loads[TOURED, c] = loads[BUSY, c] = 0
    level = 0
    if size:
        jobs[TRIED, 0] = -1
    while 0 <= level < size:
        errand, c = jobs[ERRAND, level], jobs[TRIED, level]
        if c >= 0 and not _has_another(jobs, level, c):
            loads[BUSY, c] -= jobs[TAKES, level]
            loads[TOURED, c] ^= 1 << errand
        c += 1
        while c < carriers:
            time = (
                state[c, 2]
                + errands.tours[errands.like[c], loads[ABOARD, c], state[c, 0], loads[TOURED, c] | 1 << errand]
            )
            if _has_another(jobs, level, c) or time + loads[BUSY, c] + jobs[TAKES, level] < limit:
                break
            c += 1
        if c == carriers:
            level -= 1
            continue
        tries -= 1
        if tries < 0:
            return True
        if not _has_another(jobs, level, c):
            loads[BUSY, c] += jobs[TAKES, level]
            loads[TOURED, c] |= 1 << errand
        jobs[TRIED, level] = c
        level += 1
        if level < size:
            jobs[TRIED, level] = -1
    return level == size


@compiled
def _has_another(jobs: Ints, level: int, c: int) -> bool:
    """Say whether the carrier has been given an earlier job of the same errand."""
    i = level - 1
    while i >= 0 and jobs[ERRAND, i] == jobs[ERRAND, level]:
        if jobs[TRIED, i] == c:
            return True
        i -= 1
    return False
