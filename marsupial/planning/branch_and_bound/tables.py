"""Lookup tables: the shortest tours over sets of targets, for one robot that drives, or that is carried at will.

A set of targets is a mask of bits in the order of the situation. Everything is computed on the metric closure of the
legs: a robot may drive via meetings, homes and targets (never via starts), which may be shorter in a travel table. A
*base* is where a robot can stand between two events that matter to others: a start or a meeting.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.errands import Errands, errands_of
from marsupial.planning.branch_and_bound.tours import close, end_tours, shortest_tours
from marsupial.planning.local_search import columns as given
from marsupial.planning.local_search.encoding import ProblemData
from marsupial.planning.schedule.costs import NEVER


class Tables(NamedTuple):
    """Arrays of int64; robots are numbered carriers first."""

    traits: Ints  # (robots, 5 + n): `KIND` and so on, then the n columns of `ProblemData.seats`
    tour: Ints  # (types, bases, sets, meetings): ms to explore a set beginning at a base and ending at a meeting
    # (rows, sets): ms until a robot has explored a set by itself and has nothing more to do. The rows are those of
    # `alone_row`, `relaxed_row` and `carried_row`; the last one is for robots that can't explore anything.
    solo_times: Ints
    able: Ints  # (types,): the set of targets that a type can explore
    root_state: Ints  # (robots, 3): the state that the search begins with
    carriers: int  # their number
    recover: bool  # whether all rovers have to end aboard
    errands: Errands  # the least docks, undocks and visits of carriers
    closure: Ints  # (types, places, places): the shortest times to drive, via any places
    # bases, meetings, targets, robots: bases and targets as places, meetings as bases, robots as they are numbered in
    # the situation
    bases: Ints
    meetings: Ints
    targets: Ints
    robots: Ints


@inlined
def alone_row(tables: Tables, robot: int, base: int) -> int:
    """Return the row for a robot on the ground at a base that gets no help; a carrier ends at home."""
    return robot * len(tables.bases) + base


@inlined
def relaxed_row(tables: Tables, robot: int, base: int) -> int:
    """Return the row for a rover at a base that finds a carrier at any meeting whenever it wants one: a relaxation."""
    return (len(tables.traits) + robot) * len(tables.bases) + base


@inlined
def carried_row(tables: Tables, robot: int, kind: int, base: int) -> int:
    """Return the row for the same rover aboard a carrier of type `kind` that is at the base."""
    return ((2 * len(tables.traits)) + robot * len(tables.able) + kind) * len(tables.bases) + base


def tables_of(data: ProblemData) -> Tables:
    """Return the tables of a situation; their size is exponential in the number of targets."""
    targets, meetings = data.members(given.TARGETS), data.members(given.MEETINGS)
    robots = np.concatenate([data.members(given.CARRIERS), data.members(given.ROVERS)])
    carriers = int(data.groups[given.CARRIERS, 0])
    starts = np.array([place for place in data.robots[:, given.AT] if place >= 0], dtype=np.int64)
    bases = np.concatenate([starts, meetings])
    closure = _closure(data, starts)
    exits = len(starts) + np.arange(len(meetings))
    tour, solo_times = _tours(data, closure, bases, exits, robots)
    return Tables(
        traits=_traits(data, robots, carriers),
        tour=tour,
        solo_times=solo_times,
        able=(closure[:, bases][:, :, targets] < NEVER).any(axis=1) @ (1 << np.arange(len(targets))),
        root_state=_root_state(data, robots, bases),
        carriers=carriers,
        recover=data.recover,
        errands=errands_of(data, closure, bases, robots[:carriers]),
        closure=closure,
        bases=bases,
        meetings=exits,
        targets=targets,
        robots=robots,
    )


def _tours(data: ProblemData, closure: Ints, bases: Ints, exits: Ints, robots: Ints) -> tuple[Ints, Ints]:
    """Return `tour` and `solo_times`."""
    targets, carriers = data.members(given.TARGETS), int(data.groups[given.CARRIERS, 0])
    kinds, sets = len(closure), 1 << len(targets)
    walks = [[shortest_tours(*_tour_times(closure[k], base, targets)) for base in bases] for k in range(kinds)]
    tour = np.full((kinds, len(bases), sets, len(exits)), NEVER, dtype=np.int64)
    for k, b in np.ndindex(kinds, len(bases)):
        tour[k, b] = _tours_to(closure[k], walks[k][b], int(bases[b]), targets, bases[exits])
    alone = np.full((len(robots), len(bases), sets), NEVER, dtype=np.int64)
    relaxed = alone.copy()
    carried = np.full((len(robots), kinds, len(bases), sets), NEVER, dtype=np.int64)
    for r, robot in enumerate(robots):
        k, home = data.robots[robot, given.TYPE], data.robots[robot, given.HOME : given.HOME + 1]
        twin = next((q for q in range(carriers, r) if _interchangeable(data, robots[q], robot)), -1)
        # Interchangeable robots have equal rows.
        if twin >= 0:
            alone[r], relaxed[r], carried[r] = alone[twin], relaxed[twin], carried[twin]
            continue
        for b, base in enumerate(bases):
            if r < carriers and home[0] >= 0:
                alone[r, b] = _tours_to(closure[k], walks[k][b], int(base), targets, home)[:, 0]
            elif r < carriers or not data.recover:
                open_ends = np.zeros((walks[k][b].shape[1], 1), np.int64)
                alone[r, b] = end_tours(walks[k][b], np.zeros(1, np.int64), open_ends)[:, 0]
        if r < carriers:
            relaxed[r] = alone[r]
        else:
            _fill_relaxed(data, closure, int(robot), bases, exits, relaxed[r], carried[r])
    nothing = np.full(sets, NEVER, dtype=np.int64)
    nothing[0] = 0
    return tour, np.concatenate([rows.reshape(-1, sets) for rows in (alone, relaxed, carried, nothing)])


def _tours_to(leg: Ints, walks: Ints, base: int, targets: Ints, ends: Ints) -> Ints:
    """Return (sets, ends): times of tours from a base to each of the ends."""
    return end_tours(walks, leg[base][ends], leg[np.ix_(targets, ends)])


def timeless(tables: Tables) -> Tables:
    """Return the tables of the same situation where nothing takes any time, to search for any plan at all."""
    traits, root_state = tables.traits.copy(), tables.root_state.copy()
    traits[:, [col.DOCKS, col.UNDOCKS]] = 0
    root_state[:, col.SINCE] = 0
    tour, solo_times, tours = (
        np.where(times < NEVER, 0, NEVER) for times in (tables.tour, tables.solo_times, tables.errands.tours)
    )
    errands = tables.errands._replace(tours=tours, docking=0, undocking=0)
    return tables._replace(traits=traits, tour=tour, solo_times=solo_times, root_state=root_state, errands=errands)


def _closure(data: ProblemData, starts: Ints) -> Ints:
    """Return the shortest legs via any places except starts, to which no robot can return."""
    closure = data.leg.copy()
    closure[:, :, starts] = NEVER
    for k in range(len(closure)):
        np.fill_diagonal(closure[k], np.diagonal(data.leg[k]))
        close(closure[k])
    return closure


def _tour_times(leg: Ints, base: int, targets: Ints) -> tuple[Ints, Ints]:
    return leg[base][targets], np.ascontiguousarray(leg[targets][:, targets])


def _interchangeable(data: ProblemData, one: int, other: int) -> bool:
    columns = [given.TYPE, given.HOME]
    return np.array_equal(data.robots[one, columns], data.robots[other, columns])


def _traits(data: ProblemData, robots: Ints, carriers: int) -> Ints:
    # indexed at once, as compiled code takes rows in C order only
    columns = [given.TYPE, given.CAPACITY, given.DOCKING, given.UNDOCKING, given.TYPE]
    traits = data.robots[robots[:, None], columns]
    for r, robot in enumerate(robots):
        first = 0 if r < carriers else carriers
        traits[r, col.TWIN] = min(q for q in range(first, r + 1) if _interchangeable(data, robots[q], robot))
    return np.ascontiguousarray(np.column_stack([traits, data.seats[robots]]))


def _root_state(data: ProblemData, robots: Ints, bases: Ints) -> Ints:
    number, base = {int(r): i for i, r in enumerate(robots)}, {int(p): i for i, p in enumerate(bases)}
    rows = [
        (base.get(int(row[given.AT]), -1), number.get(int(row[given.ABOARD]), -1), int(row[given.READY]))
        for row in data.robots[robots]
    ]
    return np.array(rows, dtype=np.int64).reshape(-1, 3)


def _fill_relaxed(
    data: ProblemData, closure: Ints, rover: int, bases: Ints, exits: Ints, relaxed: Ints, carried: Ints
) -> None:
    """Fill in the rows of a rover that is carried at will: `relaxed` and `carried`."""
    targets, meetings = data.members(given.TARGETS), bases[exits]
    hosts = [int(c) for c in data.members(given.CARRIERS) if data.fits(rover, int(c))]
    docking, undocking = int(data.robots[rover, given.DOCKING]), int(data.robots[rover, given.UNDOCKING])
    # Relaxation: between meetings a rover drives, or is carried at once by the fastest carrier.
    leg = closure[data.robots[rover, given.TYPE]].copy()
    for k in {int(data.robots[c, given.TYPE]) for c in hosts}:
        transport = closure[k][np.ix_(meetings, meetings)] + docking + undocking
        leg[np.ix_(meetings, meetings)] = np.minimum(leg[np.ix_(meetings, meetings)], transport)
    np.fill_diagonal(leg, 0)
    close(leg)
    ends = np.zeros(leg.shape[0], dtype=np.int64)
    if data.recover:
        homes = [
            closure[data.robots[c, given.TYPE]][meetings, data.robots[c, given.HOME]]
            if data.robots[c, given.HOME] >= 0
            else np.zeros(len(meetings), dtype=np.int64)
            for c in hosts
        ]
        leave = np.min([*homes, np.full(len(meetings), NEVER)], axis=0) + docking
        ends = np.minimum((leg[:, meetings] + leave).min(axis=1, initial=NEVER), NEVER)
    for b, base in enumerate(bases):
        tours = shortest_tours(*_tour_times(leg, base, targets))
        relaxed[b] = end_tours(tours, ends[base : base + 1], ends[targets][:, None])[:, 0]
    for k in {int(data.robots[c, given.TYPE]) for c in hosts}:
        for b, base in enumerate(bases):
            down = closure[k][base][meetings] + undocking
            if len(exits):
                carried[k, b] = np.minimum((down[:, None] + relaxed[exits]).min(axis=0), NEVER)
            carried[k, b, 0] = 0
