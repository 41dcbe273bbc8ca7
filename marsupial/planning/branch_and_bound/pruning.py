"""Whether a state can lead to a plan in time, as far as relaxations tell, and to one without a step too many."""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.cover import NO, cover
from marsupial.planning.branch_and_bound.errands import shared
from marsupial.planning.branch_and_bound.tables import Tables, carried_row, done_row, least_row
from marsupial.planning.branch_and_bound.tree import Search

TRIES = 20_000
"""Effort of a bound, see `cover`."""


@inlined
def may_lead_on(tables: Tables, search: Search, level: int) -> bool:
    """Say whether the targets left can be shared among the robots if each rover is carried when it wants."""
    state, parts = search.states[level], search.parts
    left = search.levels[level, col.LEFT]
    for r in range(len(state)):
        like, c = tables.traits[r, col.TWIN], state[r, col.ON]
        parts[r, col.MAY] = left
        parts[r, col.FROM] = state[r, col.SINCE]
        if r < tables.carriers:
            parts[r, col.ROW] = done_row(tables, like, state[r, col.WHERE])
        elif c < 0:
            parts[r, col.ROW] = least_row(tables, like, state[r, col.WHERE])
        else:
            parts[r, col.ROW] = carried_row(tables, like, tables.traits[c, col.KIND], state[c, col.WHERE])
            parts[r, col.FROM] = state[c, col.SINCE]
    if cover(tables.book, parts, search.scratch, left, search.tallies[col.LIMIT], TRIES) == NO:
        return False
    if not tables.recover and search.tallies[col.KEYED] and not _all_serve(tables, search, level):
        return False
    return _can_run_errands(tables, search, level)


@inlined
def _all_serve(tables: Tables, search: Search, level: int) -> bool:
    """Say whether every rover that was set down or picked up may have been for the sake of a target that is left.

    One that was set down for the first time may also have made room aboard, if another one could still board in time.
    """
    path, left = search.path, search.levels[level, col.LEFT]
    rest = left
    for v in range(tables.carriers, len(search.states[level])):
        count, c = 0, -1
        for i in range(1, level + 1):
            if path[i, col.ROVER] == v:
                count, c = count + 1, path[i, col.CARRIER]
        if not count or (count == 1 and tables.beginning[v, col.ON] >= 0 and _may_board(tables, search, level, c)):
            continue
        if not rest or not _may_explore(tables, search, search.parts[v, col.ROW], search.parts[v, col.FROM], left):
            return False
        rest &= rest - 1
    return True


@inlined
def _may_board(tables: Tables, search: Search, level: int, c: int) -> bool:
    """Say whether some rover could board a carrier and then explore a target in time."""
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
def _may_explore(tables: Tables, search: Search, row: int, begins: int, targets: int) -> bool:
    """Say whether a robot with that row of the book, ready at `begins`, is in time for one of a set of targets."""
    while targets:
        bit = targets & -targets
        if begins + tables.book[row, bit] < search.tallies[col.LIMIT]:
            return True
        targets ^= bit
    return False


@inlined
def _can_run_errands(tables: Tables, search: Search, level: int) -> bool:
    """Say whether the carriers can share what they at least have to do."""
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
        if out or left & errands.within[e] == 0:
            continue
        jobs[col.ERRAND, size], jobs[col.TAKES, size] = errands.down[e], errands.undocking if e < errands.rooms else 0
        size += 1
        if tables.recover and e < errands.rooms:
            jobs[col.ERRAND, size], jobs[col.TAKES, size] = errands.up[e], errands.docking
            size += 1
    for c in range(tables.carriers):
        load = more if tables.recover else 0
        for v in range(tables.carriers, len(state)):
            load += state[v, col.ON] == c
        search.loads[col.ABOARD, c] = min(load, tables.traits[c, col.PLACES], errands.tours.shape[1] - 1)
    return shared(errands, state, jobs, size, search.loads, search.tallies[col.LIMIT], TRIES)
