"""Shortest tours by dynamic programming over sets: of targets, and of carriers' errands with rovers aboard.

Both go through sets in the order of their masks: a subset has a smaller mask, so it is complete when it is needed.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Flags, Ints
from marsupial.native import inlined, native
from marsupial.planning.schedule.costs import NEVER


@native
def close(leg: Ints) -> None:
    """Lower square legs to the shortest times via any place (Floyd-Warshall)."""
    for k in range(len(leg)):
        for i in range(len(leg)):
            for j in range(len(leg)):
                if leg[i, k] + leg[k, j] < leg[i, j]:
                    leg[i, j] = leg[i, k] + leg[k, j]


@native
def shortest_tours(first: Ints, between: Ints) -> Ints:
    """Return (sets, targets): the shortest time to visit all of a set and be at a target last (Held-Karp).

    References
    ----------
    M. Held and R. M. Karp, A dynamic programming approach to sequencing problems, 1962.
    """
    n = len(first)
    tours = np.full((1 << n, n), NEVER, dtype=np.int64)
    for j in range(n):
        tours[1 << j, j] = min(first[j], NEVER)
    for s in range(1, 1 << n):
        for last in range(n):
            if tours[s, last] >= NEVER:
                continue
            for j in range(n):
                if not s >> j & 1:
                    time = tours[s, last] + between[last, j]
                    if time < tours[s | 1 << j, j]:
                        tours[s | 1 << j, j] = time
    return tours


@native
def end_tours(tours: Ints, straight: Ints, ends: Ints) -> Ints:
    """Return (sets, ends): the shortest tours to each end, from the last target or, without targets, `straight`."""
    times = np.full((len(tours), len(straight)), NEVER, dtype=np.int64)
    for e in range(len(straight)):
        times[0, e] = min(straight[e], NEVER)
        for s in range(1, len(tours)):
            for last in range(tours.shape[1]):
                if tours[s, last] < NEVER:
                    times[s, e] = min(times[s, e], tours[s, last] + ends[last, e])
    return times


ANY, ROVER_LEFT = 0, 1  # whether the carrier has just set a rover down at its place and must pick it up there later


class CarrierLegs(NamedTuple):
    """The legs of a carrier on errands, in ms."""

    first: Ints  # (bases, places): from a base to a place
    between: Ints  # (places, places)
    # straight, ends: (bases,) and (places,): to the end
    straight: Ints
    ends: Ints


class ErrandRows(NamedTuple):
    """The errands."""

    points: Flags  # (rows, places): whether the errands of a row can be done at a place
    # (rows,): the bits for picking up. They are the numbers of the rows, the bits for setting down or visiting, where
    # bits are short.
    up: Ints
    lag: Ints  # (rooms,): the least ms between setting down and picking up
    rooms: int  # as in `Errands`
    bits: int  # number of errands


@native
def errand_tours(legs: CarrierLegs, rows: ErrandRows, capacity: int, docking: int, recover: bool) -> Ints:
    """Return (loads, bases, sets): the shortest tours over errands to the end, by the rovers aboard at first.

    To set a rover down a carrier needs one aboard: one picked up on an errand, or an extra one, which costs a dock.
    """
    first, between, points, up = legs.first, legs.between, rows.points, rows.up
    n, places = points.shape
    rest = np.full((2, capacity + 1, 1 << rows.bits, places), NEVER, dtype=np.int64)
    tours = np.full((capacity + 1, len(first), 1 << rows.bits), NEVER, dtype=np.int64)
    rest[ANY, :, 0] = legs.ends
    tours[:, :, 0] = legs.straight
    for s in range(1, 1 << rows.bits):
        for load in range(capacity, -1, -1):
            for e in range(n):
                for q in range(places):
                    after = _time_after(rest, rows, recover, load, s, e, q) if points[e, q] else NEVER
                    if after >= NEVER:
                        continue
                    for p in range(places):
                        rest[ANY, load, s, p] = min(rest[ANY, load, s, p], between[p, q] + after)
                        if not points[e, p]:
                            rest[ROVER_LEFT, load, s, p] = min(rest[ROVER_LEFT, load, s, p], between[p, q] + after)
                    for b in range(len(first)):
                        tours[load, b, s] = min(tours[load, b, s], first[b, q] + after)
            # An extra rover aboard may have been docked before, for the time of a dock.
            if load < capacity:
                for p in range(places):
                    for mode in range(2):
                        rest[mode, load, s, p] = min(rest[mode, load, s, p], rest[mode, load + 1, s, p] + docking)
                for b in range(len(first)):
                    tours[load, b, s] = min(tours[load, b, s], tours[load + 1, b, s] + docking)
        for e in range(n):
            if up[e] != e and not s >> e & 1 and s >> up[e] & 1:
                _wait_for_rover(rest, between, points[e], s, 1 << up[e], rows.lag[e], docking)
    return tours


@inlined
def _wait_for_rover(rest: Ints, between: Ints, points: Flags, errands: int, pick: int, lag: int, docking: int) -> None:
    """Allow a carrier that has just set a rover down to wait and pick it up, and other rovers meanwhile."""
    capacity, places = rest.shape[1] - 1, len(points)
    for load in range(capacity + 1):
        for p in range(places):
            for q in range(places):
                if not points[p] or not points[q]:
                    continue
                for more in range(capacity + 1):
                    stay = max(between[p, q], lag, more * docking)
                    stay += rest[ANY, min(capacity, load + 1 + more), errands & ~pick, q]
                    rest[ROVER_LEFT, load, errands, p] = min(rest[ROVER_LEFT, load, errands, p], stay)


@inlined
def _time_after(rest: Ints, rows: ErrandRows, recover: bool, load: int, errands: int, row: int, place: int) -> int:
    """Return the ms that a set of errands takes after its first one, of that row at that place, is done."""
    capacity, up = rest.shape[1] - 1, rows.up
    if errands >> row & 1:
        left = errands & ~(1 << row)
        if row >= rows.rooms:
            return rest[ANY, load, left, place]
        if up[row] == row and recover:
            return rest[ANY, capacity, left, place] if capacity > 0 else NEVER
        if load == 0:
            return NEVER
        return rest[ROVER_LEFT if up[row] != row and left >> up[row] & 1 else ANY, load - 1, left, place]
    if up[row] != row and errands >> up[row] & 1 and capacity > 0:
        return rest[ANY, min(capacity, load + 1), errands & ~(1 << up[row]), place]
    return NEVER
