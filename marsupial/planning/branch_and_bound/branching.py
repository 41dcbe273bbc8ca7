"""The docks and undocks that can follow a state, each with the sets of targets explored before it."""

from __future__ import annotations

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound.tables import DOCKS, KIND, ON, PLACES, SINCE, TWIN, UNDOCKS, WHERE, Tables
from marsupial.planning.branch_and_bound.tree import (
    AT,
    BROUGHT,
    CARRIER,
    DOWN,
    END,
    FIRST,
    KEY,
    KEYED,
    LEFT,
    LIMIT,
    LOST,
    OWN,
    ROVER,
    TIES,
    Search,
)
from marsupial.planning.list_scheduling.costs import NEVER


@inlined
def branch(tables: Tables, search: Search, level: int) -> None:
    """List the docks and undocks that can follow, in the order of their ends."""
    state, carriers = search.states[level], tables.carriers
    for c in range(carriers):
        load = 0
        for v in range(carriers, len(state)):
            load += state[v, ON] == c
        for v in range(carriers, len(state)):
            if (state[v, ON] != c and (state[v, ON] >= 0 or load >= tables.traits[c, PLACES])) or _twin(
                tables, state, v
            ):
                continue
            for m in range(len(tables.meetings)):
                _list(tables, search, level, (c, v, m))
    _sort(search.events, search.levels[level, FIRST], search.levels[level + 1, FIRST])


@inlined
def _twin(tables: Tables, state: Ints, v: int) -> bool:
    """Say whether an earlier rover of the same kind is in the same position."""
    for q in range(tables.traits[v, TWIN], v):
        if (
            tables.traits[q, TWIN] == tables.traits[v, TWIN]
            and state[q, ON] == state[v, ON]
            and state[q, WHERE] == state[v, WHERE]
            and (state[q, SINCE] == state[v, SINCE] or state[v, ON] >= 0)
        ):
            return True
    return False


@inlined
def _list(tables: Tables, search: Search, level: int, who: tuple[int, int, int]) -> None:
    """List the docks or undocks for all sets of targets explored before; `who` is carrier, rover and meeting."""
    c, v, m = who
    state = search.states[level]
    left, limit = search.levels[level, LEFT], search.tallies[LIMIT]
    there = tables.tour[tables.traits[c, KIND], state[c, WHERE]]
    down = state[v, ON] == c
    takes = tables.traits[v, UNDOCKS] if down else tables.traits[v, DOCKS]
    if state[c, SINCE] + there[0, m] + takes >= limit:
        return
    able = left & tables.able[tables.traits[c, KIND]]
    own = able
    while True:
        comes = state[c, SINCE] + there[own, m]
        if comes + takes < limit:
            if down:
                if not _wider(there, own, able, m, state[c, SINCE], comes):
                    _add(search, level, who, comes + takes, own, 0, 1)
            else:
                _list_docks(tables, search, level, who, own, able, comes)
        if not own:
            return
        own = (own - 1) & able


@inlined
def _wider(tour: Ints, explored: int, able: int, m: int, since: int, time: int) -> bool:
    """Say whether one more target could be explored without being at the meeting after `time`."""
    rest = able & ~explored
    while rest:
        bit = rest & -rest
        if since + tour[explored | bit, m] <= time:
            return True
        rest ^= bit
    return False


@inlined
def _list_docks(
    tables: Tables, search: Search, level: int, who: tuple[int, int, int], own: int, own_able: int, comes: int
) -> None:
    """List the docks where the carrier comes at a time (ms) after exploring the set `own` out of `own_able`."""
    c, v, m = who
    state = search.states[level]
    left, limit = search.levels[level, LEFT], search.tallies[LIMIT]
    there = tables.tour[tables.traits[c, KIND], state[c, WHERE]]
    tour = tables.tour[tables.traits[v, KIND], state[v, WHERE]]
    if tour[0, m] >= NEVER:
        return
    takes = tables.traits[v, DOCKS]
    able = left & tables.able[tables.traits[v, KIND]] & ~own
    brought = able
    while True:
        time = max(comes, state[v, SINCE] + tour[brought, m])
        if (
            time + takes < limit
            and not _wider(tour, brought, able, m, state[v, SINCE], time)
            and not _wider(there, own, own_able & ~brought, m, state[c, SINCE], time)
        ):
            _add(search, level, who, time + takes, own, brought, 0)
        if not brought:
            return
        brought = (brought - 1) & able


@inlined
def _add(search: Search, level: int, who: tuple[int, int, int], time: int, own: int, brought: int, down: int) -> None:
    """List an event that ends at a time (ms) unless that is before the end of the last one."""
    last, events, at = search.levels[level, KEY], search.events, search.levels[level + 1, FIRST]
    key = time * TIES
    if search.tallies[KEYED]:
        if time < last // TIES:
            return
        if time == last // TIES:
            key = last + 1
    if at == len(events):
        search.tallies[LOST] = 1
        return
    events[at, END] = key
    events[at, CARRIER], events[at, ROVER], events[at, AT] = who
    events[at, OWN], events[at, BROUGHT], events[at, DOWN] = own, brought, down
    search.levels[level + 1, FIRST] = at + 1


@inlined
def _sort(events: Ints, first: int, end: int) -> None:
    """Put events in the order of their ends (Shell's sort)."""
    gap = 1
    while gap < (end - first) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(first + gap, end):
            j = i
            while j - gap >= first and events[j - gap, END] > events[j, END]:
                for k in range(7):
                    events[j, k], events[j - gap, k] = events[j - gap, k], events[j, k]
                j -= gap
        gap //= 3
