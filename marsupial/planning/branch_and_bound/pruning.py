"""Bounds: whether a state can lead to a plan below the limit, and to one without useless steps.

Each test is a relaxation: it drops a condition that real plans have to meet, so a plan that exists passes it.

- Targets: they are shared among the robots; a rover finds a carrier at any meeting at any time.
- Useless steps: each rover moved so far must reach a remaining target of its own in time.
- Carriers: they share the least docks, undocks and visits there have to be (`errands`).

A search for such a sharing gives up after `TRIES`, and the state is kept.
"""

from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.columns import SearchState
from marsupial.planning.branch_and_bound.cover import NO, cover
from marsupial.planning.branch_and_bound.errands import can_share
from marsupial.planning.branch_and_bound.tables import Tables, alone_row, carried_row, relaxed_row

TRIES = 20_000  # most assignments tried for a bound, see `cover`


@inlined
def may_lead_to_plan(tables: Tables, search: SearchState, level: int) -> bool:
    """Return whether a state passes all bounds."""
    state, assignments = search.states[level], search.assignments
    left = search.levels[level, col.LEFT]
    for r in range(len(state)):
        like, c = tables.traits[r, col.TWIN], state[r, col.ON]
        assignments[r, col.ALLOWED] = left
        assignments[r, col.READY] = state[r, col.SINCE]
        if r < tables.carriers:
            assignments[r, col.ROW] = alone_row(tables, like, state[r, col.WHERE])
        elif c < 0:
            assignments[r, col.ROW] = relaxed_row(tables, like, state[r, col.WHERE])
        else:
            assignments[r, col.ROW] = carried_row(tables, like, tables.traits[c, col.KIND], state[c, col.WHERE])
            assignments[r, col.READY] = state[c, col.SINCE]
    if cover(tables.solo_times, assignments, search.scratch, left, search.counters[col.LIMIT], TRIES) == NO:
        return False
    if not tables.recover and search.counters[col.KEYED] and not _all_transfers_useful(tables, search, level):
        return False
    return _can_run_errands(tables, search, level)


@inlined
def _all_transfers_useful(tables: Tables, search: SearchState, level: int) -> bool:
    """Return whether every rover that was set down or picked up may still serve a target that is left."""
    assignments = search.assignments
    path, left = search.path, search.levels[level, col.LEFT]
    rest = left
    for v in range(tables.carriers, len(search.states[level])):
        count, c = 0, -1
        for i in range(1, level + 1):
            if path[i, col.ROVER] == v:
                count, c = count + 1, path[i, col.CARRIER]
        # Never moved, or set down once to make room: no reason needed.
        if not count or (count == 1 and tables.root_state[v, col.ON] >= 0 and _may_board(tables, search, level, c)):
            continue
        if not rest or not _may_explore(tables, search, assignments[v, col.ROW], assignments[v, col.READY], left):
            return False
        rest &= rest - 1  # one target fewer for the other rovers, whichever it is
    return True


@inlined
def _may_board(tables: Tables, search: SearchState, level: int, c: int) -> bool:
    """Return whether some rover could board a carrier and then explore a target in time."""
    state, left = search.states[level], search.levels[level, col.LEFT]
    kind = tables.traits[c, col.KIND]
    for v in range(tables.carriers, len(state)):
        if tables.traits[v, col.TWIN] != v:
            continue
        for m in range(len(tables.meetings)):
            aboard = state[c, col.SINCE] + tables.tour[kind, state[c, col.WHERE], 0, m] + tables.traits[v, col.DOCKS]
            if _may_explore(tables, search, carried_row(tables, v, kind, tables.meetings[m]), aboard, left):
                return True
    return False


@inlined
def _may_explore(tables: Tables, search: SearchState, row: int, begins: int, targets: int) -> bool:
    """Return whether a robot with a row of `solo_times`, ready at `begins`, is in time for one of a set of targets."""
    while targets:
        bit = targets & -targets
        if begins + tables.solo_times[row, bit] < search.counters[col.LIMIT]:
            return True
        targets ^= bit
    return False


@inlined
def _can_run_errands(tables: Tables, search: SearchState, level: int) -> bool:
    """Return whether the carriers can share the least docks, undocks and visits there have to be."""
    state, jobs, size = search.states[level], search.jobs, 0
    left, errands = search.levels[level, col.LEFT], tables.errands
    more = 0
    for e in range(len(errands.within)):
        out = 0
        if e < errands.rooms:
            for v in range(tables.carriers, len(state)):
                if state[v, col.ON] < 0 and errands.room[state[v, col.WHERE]] == e:
                    out += 1
                    if tables.recover:
                        jobs[col.ERRAND, size], jobs[col.TAKES, size] = errands.up[e], tables.traits[v, col.DOCKS]
                        size += 1
            more += max(0, out - 1)
        # A rover is in the room already, or nothing is left to do there.
        if out or left & errands.within[e] == 0:
            continue
        jobs[col.ERRAND, size], jobs[col.TAKES, size] = e, errands.undocking if e < errands.rooms else 0
        size += 1
        if tables.recover and e < errands.rooms:
            jobs[col.ERRAND, size], jobs[col.TAKES, size] = errands.up[e], errands.docking
            size += 1
    for c in range(tables.carriers):
        # Spare rovers on the ground may be picked up first: a relaxation counts them as aboard every carrier.
        load = more if tables.recover else 0
        for v in range(tables.carriers, len(state)):
            load += state[v, col.ON] == c
        search.loads[col.ABOARD, c] = min(load, tables.traits[c, col.PLACES], errands.tours.shape[1] - 1)
    return can_share(errands, state, jobs, size, search.loads, search.counters[col.LIMIT], TRIES)
