"""A lower bound on the work of carriers: errands, each a bit, shared among them.

A *room* is a set of places between which rovers can drive: a rover set down there stays until it is picked up at one of
the room's meetings. Every room without a rover and with targets that no carrier explores has to be visited to set one
down. Where rovers have to end aboard, every rover on the ground has to be picked up in its room, and so has the one to
be set down: the last rover picked up there cannot be aboard before the first one set down has had time to explore a
target of the room. A target that no rover explores has to be visited by a carrier. Each carrier has to be done in time
with the shortest tour over its errands, in which a carrier that both sets down first and picks up last in a room goes
somewhere else in between, or waits.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.tours import CarrierLegs, ErrandRows, errand_tours
from marsupial.planning.local_search import columns as given
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.schedule.costs import NEVER

BITS = 16  # most errands; leaving out others only weakens the bound
TOURS_BYTES = 1 << 25  # most memory for tours over sets of errands; there are fewer errands where that is not enough


class Errands(NamedTuple):
    """Arrays of int64."""

    room: Ints  # (bases,): the row, of those below, of the room that a rover at the base is in, -1 if none
    within: Ints  # (rows,): the set of targets that make the errands of a row necessary
    up: Ints  # (rows,): the bits for picking up; the rows, which are those for setting down, where bits are short
    rooms: int  # how many of the rows, the first ones, are rooms; the others are carriers' targets
    # (n, rovers aboard, bases, sets of errands): ms for a carrier to do them and go home, without the time to dock and
    # undock
    tours: Ints
    like: Ints  # (carriers,): the first index of `tours`
    # docking, undocking: the least ms these take
    docking: int
    undocking: int


def errands_of(data: ProblemData, closure: Ints, bases: Ints, carriers: Ints) -> Errands:
    """Return the errands of a situation; `carriers` are robots of the data."""
    rovers = data.members(given.ROVERS)
    pairs, like = np.unique(data.robots[carriers][:, [given.TYPE, given.HOME]], axis=0, return_inverse=True)
    like = like.reshape(-1).astype(np.int64)
    most = np.minimum(data.robots[carriers, given.CAPACITY], len(rovers))
    capacities = np.array([most[like == i][0] for i in range(len(pairs))], dtype=np.int64)
    loads = 1 + int(most.max(initial=0))
    sets = TOURS_BYTES // max(1, 8 * len(pairs) * loads * len(bases))
    room, within, places, rows = _find_errands(data, closure, bases, min(BITS, sets.bit_length() - 1))
    docking = int(data.robots[rovers, given.DOCKING].min(initial=NEVER))
    tours = np.full((len(pairs), loads, len(bases), 1 << rows.bits), NEVER, dtype=np.int64)
    for i, (kind, home) in enumerate(pairs):
        leg = closure[kind]
        ends = leg[:, home] if home >= 0 else np.zeros(len(leg), dtype=np.int64)
        legs = CarrierLegs(
            first=np.ascontiguousarray(leg[np.ix_(bases, places)]),
            between=np.ascontiguousarray(leg[np.ix_(places, places)]),
            straight=np.ascontiguousarray(ends[bases]),
            ends=np.ascontiguousarray(ends[places]),
        )
        tours[i, : capacities[i] + 1] = errand_tours(legs, rows, int(capacities[i]), docking, data.recover)
    return Errands(
        room=room,
        within=within,
        up=rows.up,
        rooms=rows.rooms,
        tours=tours,
        like=like,
        docking=docking,
        undocking=int(data.robots[rovers, given.UNDOCKING].min(initial=NEVER)),
    )


def _find_errands(data: ProblemData, closure: Ints, bases: Ints, most: int) -> tuple[Ints, Ints, Ints, ErrandRows]:
    """Return `room`, `within`, the places of errands and their rows, with at most `most` bits."""
    from scipy.sparse.csgraph import connected_components  # few missions ask this engine, which all import

    targets, meetings = data.members(given.TARGETS), data.members(given.MEETINGS)
    groups = (given.ROVERS, given.CARRIERS)
    by_rover, by_carrier = (closure[np.unique(data.robots[data.members(g), given.TYPE])] for g in groups)
    _, component = connected_components(by_rover.min(axis=0, initial=NEVER) < NEVER, directed=False)
    own, theirs = (
        (kinds[:, bases].min(axis=(0, 1), initial=NEVER) < NEVER)[targets] for kinds in (by_carrier, by_rover)
    )
    labels = list(dict.fromkeys(int(component[m]) for m in meetings))[:most]
    lone = [j for j in range(len(targets)) if own[j] and not theirs[j]][: most - len(labels)]
    room = np.full(len(bases), -1, dtype=np.int64)
    for row, label in enumerate(labels):
        room[component[bases] == label] = row
    doors = [meetings[component[meetings] == label] for label in labels]
    sets = [np.flatnonzero((component[targets] == label) & ~own) for label in labels]
    # Too few bits: setting down comes first, then picking up for as many rooms as there are bits left.
    up, picked_up = np.arange(len(labels) + len(lone)), 0
    if data.recover:
        picked_up = min(most - len(up), len(labels))
        up[:picked_up] = len(up) + np.arange(picked_up)
    points = [*doors, *(targets[j : j + 1] for j in lone)]
    places = np.unique(np.concatenate([meetings[:0], *points]))
    within = np.array([*((1 << s).sum() for s in sets), *(1 << j for j in lone)], dtype=np.int64)
    lags = [_least_sortie(by_rover, d, targets[s]) for d, s in zip(doors, sets, strict=True)]
    rows = ErrandRows(
        points=np.array([np.isin(places, p) for p in points], dtype=np.bool_).reshape(len(points), len(places)),
        up=up,
        lag=np.array(lags, dtype=np.int64),
        rooms=len(labels),
        bits=len(up) + picked_up,
    )
    return room, within, places, rows


def _least_sortie(closure: Ints, meetings: Ints, targets: Ints) -> int:
    """Return the least ms a rover takes from any of the meetings to a target and back to any of them."""
    if not closure.size:
        return NEVER
    out = closure[:, meetings][:, :, targets].min(axis=1, initial=NEVER)
    back = closure[:, targets][:, :, meetings].min(axis=2, initial=NEVER)
    return min(NEVER, int((out + back).min(initial=NEVER)))


@inlined
def can_share(errands: Errands, state: Ints, jobs: Ints, size: int, loads: Ints, limit: int, tries: int) -> bool:
    """Return whether carriers can share `jobs`, sorted by bit, before `limit`; True if it takes long to find out."""
    carriers = loads.shape[1]
    for c in range(carriers):
        loads[col.TOURED, c] = loads[col.BUSY, c] = 0
    level = 0
    if size:
        jobs[col.TRIED, 0] = -1
    while 0 <= level < size:
        errand, c = jobs[col.ERRAND, level], jobs[col.TRIED, level]
        # Undo the assignment tried before, unless another job of the same errand needs it.
        if c >= 0 and not _has_same_errand(jobs, level, c):
            loads[col.BUSY, c] -= jobs[col.TAKES, level]
            loads[col.TOURED, c] ^= 1 << errand
        c += 1
        while c < carriers:
            tours = errands.tours[errands.like[c], loads[col.ABOARD, c], state[c, col.WHERE]]
            time = state[c, col.SINCE] + tours[loads[col.TOURED, c] | 1 << errand]
            if _has_same_errand(jobs, level, c) or time + loads[col.BUSY, c] + jobs[col.TAKES, level] < limit:
                break
            c += 1
        if c == carriers:
            level -= 1
            continue
        tries -= 1
        if tries < 0:
            return True
        if not _has_same_errand(jobs, level, c):
            loads[col.BUSY, c] += jobs[col.TAKES, level]
            loads[col.TOURED, c] |= 1 << errand
        jobs[col.TRIED, level] = c
        level += 1
        if level < size:
            jobs[col.TRIED, level] = -1
    return level == size


@inlined
def _has_same_errand(jobs: Ints, level: int, c: int) -> bool:
    i = level - 1
    while i >= 0 and jobs[col.ERRAND, i] == jobs[col.ERRAND, level]:
        if jobs[col.TRIED, i] == c:
            return True
        i -= 1
    return False
