"""Whether a state can lead to a plan in time, as far as relaxations tell."""

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
    return _can_run_errands(tables, search, level)


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
