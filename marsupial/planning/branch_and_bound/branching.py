"""Branching: the docks and undocks that can follow a state, each with the sets of targets explored before it.

Subsets of a set are enumerated as masks, from the whole set down to none: `(s - 1) & whole` is the one after `s`.
"""

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.columns import SearchState
from marsupial.planning.branch_and_bound.tables import Tables
from marsupial.planning.schedule.costs import NEVER


@inlined
def branch(tables: Tables, search: SearchState, level: int) -> None:
    """List the docks and undocks that can follow, sorted by their ends."""
    state, carriers = search.states[level], tables.carriers
    for c in range(carriers):
        load = 0
        for v in range(carriers, len(state)):
            load += state[v, col.ON] == c
        for v in range(carriers, len(state)):
            possible = state[v, col.ON] == c or (state[v, col.ON] < 0 and load < tables.traits[c, col.PLACES])
            if not possible or _has_twin_before(tables, state, v):
                continue
            if tables.traits.shape[1] > col.SEATS and state[v, col.ON] < 0 and not _has_seat(tables, state, c, v):
                continue
            for m in range(len(tables.meetings)):
                _list_transfers(tables, search, level, (c, v, m))
    _sort(search.events, search.levels[level, col.FIRST], search.levels[level + 1, col.FIRST])


@inlined
def _has_twin_before(tables: Tables, state: Ints, v: int) -> bool:
    """Return whether an earlier, interchangeable rover is in the same position; one of them is enough to branch on."""
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
def _has_seat(tables: Tables, state: Ints, c: int, v: int) -> bool:
    """Return whether a carrier has a seat for a rover."""
    free = tables.traits[c, col.SEATS + tables.traits[v, col.KIND]]
    for other in range(tables.carriers, len(state)):
        free -= state[other, col.ON] == c and tables.traits[other, col.SEATS + tables.traits[v, col.KIND]]
    return free > 0


@inlined
def _list_transfers(tables: Tables, search: SearchState, level: int, who: tuple[int, int, int]) -> None:
    """List the docks or undocks of `who` (carrier, rover, meeting) for all sets of targets explored before."""
    c, v, m = who
    state = search.states[level]
    left, limit = search.levels[level, col.LEFT], search.counters[col.LIMIT]
    there = tables.tour[tables.traits[c, col.KIND], state[c, col.WHERE]]
    down = state[v, col.ON] == c
    takes = tables.traits[v, col.UNDOCKS] if down else tables.traits[v, col.DOCKS]
    if down and tables.tour[tables.traits[v, col.KIND], tables.meetings[m], 0, m] >= NEVER:
        return  # the rover can't stand there
    if state[c, col.SINCE] + there[0, m] + takes >= limit:
        return
    able = left & tables.able[tables.traits[c, col.KIND]]
    # All subsets of what the carrier can explore, the whole set first.
    own = able
    while True:
        comes = state[c, col.SINCE] + there[own, m]
        if comes + takes < limit:
            if down:
                # Another target fits in with the same end: that larger set dominates.
                if not _can_grow(there, own, able, m, state[c, col.SINCE], comes):
                    _add_event(search, level, who, comes + takes, own, 0, 1)
            else:
                _list_docks(tables, search, level, who, own, able, comes)
        if not own:
            return
        own = (own - 1) & able


@inlined
def _can_grow(tour: Ints, explored: int, able: int, m: int, since: int, time: int) -> bool:
    """Return whether one more target could be explored without being at the meeting after `time`."""
    rest = able & ~explored
    while rest:
        bit = rest & -rest
        if since + tour[explored | bit, m] <= time:
            return True
        rest ^= bit
    return False


@inlined
def _list_docks(
    tables: Tables, search: SearchState, level: int, who: tuple[int, int, int], own: int, own_able: int, comes: int
) -> None:
    """List the docks of a carrier that explores the set `own` of `own_able` and arrives at `comes` (ms)."""
    c, v, m = who
    state = search.states[level]
    left, limit = search.levels[level, col.LEFT], search.counters[col.LIMIT]
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
            and not _can_grow(tour, brought, able, m, state[v, col.SINCE], time)
            # The carrier may wait for the rover, and could explore more targets in the meantime.
            and not _can_grow(there, own, own_able & ~brought, m, state[c, col.SINCE], time)
        ):
            _add_event(search, level, who, time + takes, own, brought, 0)
        if not brought:
            return
        brought = (brought - 1) & able


@inlined
def _add_event(
    search: SearchState, level: int, who: tuple[int, int, int], time: int, own: int, brought: int, down: int
) -> None:
    """List an event that ends at `time` (ms), unless the last event ended later."""
    last, events, at = search.levels[level, col.KEY], search.events, search.levels[level + 1, col.FIRST]
    key = time * col.KEY_SCALE
    if search.counters[col.KEYED]:
        # Only steps in the order of their ends; equal ends count up, so keys grow strictly along a path.
        if time < last // col.KEY_SCALE:
            return
        if time == last // col.KEY_SCALE:
            key = last + 1
    if at == len(events):
        search.counters[col.INCOMPLETE] = 1
        return
    events[at, col.END] = key
    events[at, col.CARRIER], events[at, col.ROVER], events[at, col.AT] = who
    events[at, col.OWN], events[at, col.BROUGHT], events[at, col.DOWN] = own, brought, down
    search.levels[level + 1, col.FIRST] = at + 1


@inlined
def _sort(events: Ints, first: int, end: int) -> None:
    """Sort events by their ends (Shell sort: in place, without allocating)."""
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
