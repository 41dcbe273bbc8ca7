"""The docks and undocks that can follow a state, each with the sets of targets explored before it."""

from __future__ import annotations

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.tables import Tables
from marsupial.planning.branch_and_bound.tree import Search
from marsupial.planning.list_scheduling.costs import NEVER


@inlined
def branch(tables: Tables, search: Search, level: int) -> None:
    """List the docks and undocks that can follow, in the order of their ends."""
    state, carriers = search.states[level], tables.carriers
    for c in range(carriers):
        load = 0
        for v in range(carriers, len(state)):
            load += state[v, col.ON] == c
        for v in range(carriers, len(state)):
            if (state[v, col.ON] != c and (state[v, col.ON] >= 0 or load >= tables.traits[c, col.PLACES])) or _twin(
                tables, state, v
            ):
                continue
            for m in range(len(tables.meetings)):
                _list(tables, search, level, (c, v, m))
    _sort(search.events, search.levels[level, col.FIRST], search.levels[level + 1, col.FIRST])


@inlined
def _twin(tables: Tables, state: Ints, v: int) -> bool:
    """Say whether an earlier rover of the same kind is in the same position."""
    for q in range(tables.traits[v, col.TWIN], v):
        if (
            tables.traits[q, col.TWIN] == tables.traits[v, col.TWIN]
            and state[q, col.ON] == state[v, col.ON]
            and state[q, col.WHERE] == state[v, col.WHERE]
            and (state[q, col.SINCE] == state[v, col.SINCE] or state[v, col.ON] >= 0)
        ):
            return True
    return False


@inlined
def _list(tables: Tables, search: Search, level: int, who: tuple[int, int, int]) -> None:
    """List the docks or undocks for all sets of targets explored before; `who` is carrier, rover and meeting."""
    c, v, m = who
    state = search.states[level]
    left, limit = search.levels[level, col.LEFT], search.tallies[col.LIMIT]
    there = tables.tour[tables.traits[c, col.KIND], state[c, col.WHERE]]
    down = state[v, col.ON] == c
    takes = tables.traits[v, col.UNDOCKS] if down else tables.traits[v, col.DOCKS]
    if state[c, col.SINCE] + there[0, m] + takes >= limit:
        return
    able = left & tables.able[tables.traits[c, col.KIND]]
    own = able
    while True:
        comes = state[c, col.SINCE] + there[own, m]
        if comes + takes < limit:
            if down:
                if not _wider(there, own, able, m, state[c, col.SINCE], comes):
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
    left, limit = search.levels[level, col.LEFT], search.tallies[col.LIMIT]
    there = tables.tour[tables.traits[c, col.KIND], state[c, col.WHERE]]
    tour = tables.tour[tables.traits[v, col.KIND], state[v, col.WHERE]]
    if tour[0, m] >= NEVER:
        return
    takes = tables.traits[v, col.DOCKS]
    able = left & tables.able[tables.traits[v, col.KIND]] & ~own
    brought = able
    while True:
        time = max(comes, state[v, col.SINCE] + tour[brought, m])
        if (
            time + takes < limit
            and not _wider(tour, brought, able, m, state[v, col.SINCE], time)
            and not _wider(there, own, own_able & ~brought, m, state[c, col.SINCE], time)
        ):
            _add(search, level, who, time + takes, own, brought, 0)
        if not brought:
            return
        brought = (brought - 1) & able


@inlined
def _add(search: Search, level: int, who: tuple[int, int, int], time: int, own: int, brought: int, down: int) -> None:
    """List an event that ends at a time (ms) unless that is before the end of the last one."""
    last, events, at = search.levels[level, col.KEY], search.events, search.levels[level + 1, col.FIRST]
    key = time * col.TIES
    if search.tallies[col.KEYED]:
        if time < last // col.TIES:
            return
        if time == last // col.TIES:
            key = last + 1
    if at == len(events):
        search.tallies[col.LOST] = 1
        return
    events[at, col.END] = key
    events[at, col.CARRIER], events[at, col.ROVER], events[at, col.AT] = who
    events[at, col.OWN], events[at, col.BROUGHT], events[at, col.DOWN] = own, brought, down
    search.levels[level + 1, col.FIRST] = at + 1


@inlined
def _sort(events: Ints, first: int, end: int) -> None:
    """Put events in the order of their ends (Shell's sort)."""
    gap = 1
    while gap < (end - first) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(first + gap, end):
            j = i
            while j - gap >= first and events[j - gap, col.END] > events[j, col.END]:
                for k in range(7):
                    events[j, k], events[j - gap, k] = events[j - gap, k], events[j, k]
                j -= gap
        gap //= 3
