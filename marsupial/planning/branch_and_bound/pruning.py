"""Whether a state can lead to a plan in time, as far as relaxations tell."""

from __future__ import annotations

from marsupial.native import inlined
from marsupial.planning.branch_and_bound.cover import FROM, MAY, NO, ROW, cover
from marsupial.planning.branch_and_bound.errands import ABOARD, ERRAND, TAKES, shared
from marsupial.planning.branch_and_bound.tables import (
    DOCKS,
    KIND,
    ON,
    PLACES,
    SINCE,
    TWIN,
    WHERE,
    Tables,
    carried_row,
    done_row,
    least_row,
)
from marsupial.planning.branch_and_bound.tree import LEFT, LIMIT, Search

TRIES = 20_000
"""Effort of a bound, see `cover`."""


@inlined
def may_lead_on(tables: Tables, search: Search, level: int) -> bool:
    """Say whether the targets left can be shared among the robots if each rover is carried when it wants."""
    state, parts = search.states[level], search.parts
    left = search.levels[level, LEFT]
    for r in range(len(state)):
        like, c = tables.traits[r, TWIN], state[r, ON]
        parts[r, MAY] = left
        parts[r, FROM] = state[r, SINCE]
        if r < tables.carriers:
            parts[r, ROW] = done_row(tables, like, state[r, WHERE])
        elif c < 0:
            parts[r, ROW] = least_row(tables, like, state[r, WHERE])
        else:
            parts[r, ROW] = carried_row(tables, like, tables.traits[c, KIND], state[c, WHERE])
            parts[r, FROM] = state[c, SINCE]
    if cover(tables.book, parts, search.scratch, left, search.tallies[LIMIT], TRIES) == NO:
        return False
    return _can_run_errands(tables, search, level)


@inlined
def _can_run_errands(tables: Tables, search: Search, level: int) -> bool:
    """Say whether the carriers can share what they at least have to do."""
    state, jobs, size = search.states[level], search.jobs, 0
    left, errands = search.levels[level, LEFT], tables.errands
    more = 0
    for e in range(len(errands.within)):
        out = 0
        if e < errands.rooms:
            for v in range(tables.carriers, len(state)):
                if state[v, ON] < 0 and errands.room[state[v, WHERE]] == e:
                    out += 1
                    if tables.recover:
                        jobs[ERRAND, size], jobs[TAKES, size] = errands.up[e], tables.traits[v, DOCKS]
                        size += 1
            more += max(0, out - 1)
        if out or left & errands.within[e] == 0:
            continue
        jobs[ERRAND, size], jobs[TAKES, size] = errands.down[e], errands.undocking if e < errands.rooms else 0
        size += 1
        if tables.recover and e < errands.rooms:
            jobs[ERRAND, size], jobs[TAKES, size] = errands.up[e], errands.docking
            size += 1
    for c in range(tables.carriers):
        load = more if tables.recover else 0
        for v in range(tables.carriers, len(state)):
            load += state[v, ON] == c
        search.loads[ABOARD, c] = min(load, tables.traits[c, PLACES], errands.tours.shape[1] - 1)
    return shared(errands, state, jobs, size, search.loads, search.tallies[LIMIT], TRIES)
