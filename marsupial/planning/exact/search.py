"""Depth-first branch and bound over docks and undocks, whose end proves that no shorter plan exists.

What is searched. To the checker a plan is one list of actions per robot, docks and undocks being in two of them, each
of which can begin as soon as its robots are ready: begun then, in any order that keeps the lists, a plan is as good as
before. What a robot does between two of its docks and undocks concerns nobody else but for the targets explored. So a
state is: the targets left, where each robot is (or on whom) since its last dock or undock, and when it was ready then.
One step is a dock or an undock, and with it the sets of targets that its carrier and (before a dock) its rover have
explored on the way there; tours over sets are shortest ones, on the closure of the legs (`tables`). After the last
step the targets left are shared among the robots on the ground (`cover`). Choosing sets when they matter, instead of
targets one by one, is what keeps the search small: the order of what different robots explore is never looked at.

What is left out, and why no shorter plan is lost:

- States from which the goal can't be reached in time: `_hopeful`, made of relaxations only.
- Steps that end before the last one did (`KEY`: end, then how many steps ended at that ms). Such a step shares no robot
  with the last one, so it could come before it, with the same result or a better one.
- A set that could be larger without its step ending later: whoever has explored more has less to do.
- A state no better than one met before: the same robots (or ones like them) at the same places, the same targets left,
  nobody ready earlier, and a key no lower.

These do not lose a plan in turns. Call a state that is entered and the steps from it to a plan shorter than all that
are found a way out, its times being delayed to those of the last step where they are earlier. Compare ways out by the
multiset of their steps' keys and of their state's key. Were there any, take a least one. Its first step is not listed
because it would be delayed: then it could come before some last steps, which gives a way out in which this key is
replaced with lower ones. Or its set could be larger, or its state is no better than one entered: then that one has a
way out with keys no higher and one step less. Or its state is entered: then there is one step less as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from marsupial.planning.anytime.encoding import NEVER, Ints
from marsupial.planning.anytime.kernel import compiled
from marsupial.planning.exact.cover import FROM, MAY, NO, ROW, SHARE, YES, cover
from marsupial.planning.exact.errands import ABOARD, BITS, ERRAND, TAKES, shared
from marsupial.planning.exact.memory import BUCKET, remember
from marsupial.planning.exact.tables import (
    DOCKS,
    KIND,
    ON,
    PLACES,
    SINCE,
    TWIN,
    UNDOCKS,
    WHERE,
    Tables,
    done_row,
    least_row,
    riding_row,
)

LEVELS = 60
"""How many docks and undocks there can be in a row; where more are needed nothing is proven."""

WIDTH = 1 << 17
"""How many events can wait at a time; where there are more nothing is proven."""

TRIES = 20_000
"""Effort of a bound, see `cover`."""

LEFT, KEY, FIRST, NEXT = 0, 1, 2, 3
"""Columns of levels: targets left, key of the last event, index of the first event that can follow and of the next."""

TIES = 64
"""A key is when an event ends, times this, and how many events before it end at the same ms."""

END, ROVER, CARRIER, AT, OWN, BROUGHT, DOWN = range(7)
"""Columns of events: key, robots, number of the meeting, sets explored by carrier and rover, whether an undock."""

LEVEL, NODES, LIMIT, FOUND, LOST, KEYED, SEEN, BOUND = range(8)
"""Tallies: the current level (-1: at the end), states entered, ms (with epsilon) that plans have to be shorter than,
1 + the length of `path` of the best plan (0: none), whether something was left out for lack of space, whether keys are
kept (not where nothing takes time), states met before, states without hope."""


class Search(NamedTuple):
    """What a search remembers between calls.

    Attributes
    ----------
    states
        (levels, robots, 3): see `tables`.
    levels
        (levels, 4): `LEFT` and so on.
    events
        (n, 7): those listed for all levels up to the current one; `END` and so on.
    path
        (levels, 7): the event that led to each level.
    best
        (levels, 7): the path of the best plan.
    shares
        (robots,): the sets that robots explore after it.
    parts, scratch
        See `cover`.
    jobs, loads
        See `shared`.
    tallies
        (8,): `LEVEL` and so on.
    memory, order
        See `remember`.
    """

    states: Ints
    levels: Ints
    events: Ints
    path: Ints
    best: Ints
    shares: Ints
    parts: Ints
    scratch: Ints
    tallies: Ints
    jobs: Ints
    loads: Ints
    memory: Ints
    order: Ints


def search_of(tables: Tables, limit: int, entries: int, *, keyed: bool = True) -> Search:
    """Return a search for plans shorter than `limit` ms, epsilon included, that remembers so many states."""
    robots, targets = len(tables.traits), len(tables.targets)
    tallies = np.zeros(8, dtype=np.int64)
    tallies[LIMIT] = limit
    tallies[KEYED] = keyed
    tallies[LEVEL] = 0
    search = Search(
        states=np.zeros((LEVELS, robots, 3), dtype=np.int64),
        levels=np.zeros((LEVELS, 4), dtype=np.int64),
        events=np.zeros((WIDTH, 7), dtype=np.int64),
        path=np.zeros((LEVELS, 7), dtype=np.int64),
        best=np.zeros((LEVELS, 7), dtype=np.int64),
        shares=np.zeros(robots, dtype=np.int64),
        parts=np.zeros((robots, 4), dtype=np.int64),
        scratch=np.zeros((4, max(1, targets)), dtype=np.int64),
        tallies=tallies,
        jobs=np.zeros((3, robots + 2 * BITS), dtype=np.int64),
        loads=np.zeros((3, tables.carriers), dtype=np.int64),
        memory=np.zeros((entries, robots + 3), dtype=np.int64),
        order=np.zeros((2, robots + 3), dtype=np.int64),
    )
    search.states[0] = tables.beginning
    search.levels[0, LEFT] = (1 << targets) - 1
    enter(tables, search)
    return search


def root_bound_ms(tables: Tables, limit: int) -> int:
    """Return a time no later than `limit` that no plan ends before, epsilon included."""
    search = search_of(tables, 0, BUCKET)
    low, high = 0, limit
    while low < high:
        middle = (low + high + 1) // 2
        search.tallies[LIMIT] = middle
        if hopeful(tables, search):
            high = middle - 1
        else:
            low = middle
    return low


@njit(cache=True, nogil=True)
def hopeful(tables: Tables, search: Search) -> bool:
    """Say whether there may be plans shorter than the limit."""
    return _hopeful(tables, search, 0)


@njit(cache=True, nogil=True)
def enter(tables: Tables, search: Search) -> None:
    """Enter the first state."""
    _enter(tables, search, 0)


@njit(cache=True, nogil=True)
def advance(tables: Tables, search: Search, nodes: int) -> bool:
    """Enter that many nodes; return whether there may be more."""
    tallies, levels = search.tallies, search.levels
    until = tallies[NODES] + nodes
    while tallies[NODES] < until:
        level = tallies[LEVEL]
        if level < 0:
            return False
        at = levels[level, NEXT]
        if at == _end(search, level):
            tallies[LEVEL] -= 1
            continue
        levels[level, NEXT] += 1
        if search.events[at, END] // TIES >= tallies[LIMIT]:
            levels[level, NEXT] = _end(search, level)
            continue
        _apply(tables, search, level, at)
        tallies[LEVEL] += 1
        tallies[NODES] += 1
        _enter(tables, search, level + 1)
    return tallies[LEVEL] >= 0


@compiled
def _end(search: Search, level: int) -> int:
    return search.levels[level + 1, FIRST]


@compiled
def _apply(tables: Tables, search: Search, level: int, at: int) -> None:
    """Make the state of the next level by an event."""
    events = search.events
    old, state = search.states[level], search.states[level + 1]
    for r in range(len(state)):
        for k in range(3):
            state[r, k] = old[r, k]
    for k in range(7):
        search.path[level + 1, k] = events[at, k]
    v, c = events[at, ROVER], events[at, CARRIER]
    base = tables.meetings[events[at, AT]]
    time = events[at, END] // TIES
    state[c, WHERE], state[c, SINCE] = base, time
    if events[at, DOWN]:
        state[v, WHERE], state[v, ON], state[v, SINCE] = base, -1, time
    else:
        state[v, WHERE], state[v, ON], state[v, SINCE] = -1, c, 0
    search.levels[level + 1, LEFT] = search.levels[level, LEFT] & ~(events[at, OWN] | events[at, BROUGHT])
    search.levels[level + 1, KEY] = events[at, END]


@compiled
def _enter(tables: Tables, search: Search, level: int) -> None:
    """Prune the state of a level, or look whether it is the end of a plan and list the events that can follow."""
    levels, tallies = search.levels, search.tallies
    first = levels[level, FIRST]
    levels[level, NEXT] = first
    levels[level + 1, FIRST] = first
    if not _hopeful(tables, search, level):
        tallies[BOUND] += 1
        return
    if remember(tables, search.memory, search.order, search.states[level], levels[level, LEFT], levels[level, KEY]):
        tallies[SEEN] += 1
        return
    _complete(tables, search, level)
    if level + 2 >= LEVELS:
        tallies[LOST] = 1
        return
    _branch(tables, search, level)
    _sort(search.events, first, levels[level + 1, FIRST])


@compiled
def _hopeful(tables: Tables, search: Search, level: int) -> bool:
    """Say whether the targets left can be shared among the robots if each rover rides when it wants."""
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
            parts[r, ROW] = riding_row(tables, like, tables.traits[c, KIND], state[c, WHERE])
            parts[r, FROM] = state[c, SINCE]
    if cover(tables.book, parts, search.scratch, left, search.tallies[LIMIT], TRIES) == NO:
        return False
    return _can_run_errands(tables, search, level)


@compiled
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


@compiled
def _complete(tables: Tables, search: Search, level: int) -> None:
    """If no dock or undock has to follow, note the plan in which none follows, and shorter ones of that kind."""
    state, parts, tallies = search.states[level], search.parts, search.tallies
    left = search.levels[level, LEFT]
    for r in range(len(state)):
        parts[r, MAY] = left
        parts[r, FROM] = state[r, SINCE]
        if state[r, ON] >= 0:
            parts[r, ROW] = len(tables.book) - 1
        else:
            if r >= tables.carriers and tables.recover:
                return
            parts[r, ROW] = done_row(tables, tables.traits[r, TWIN], state[r, WHERE])
    begun = search.levels[level, KEY] // TIES
    while begun < tallies[LIMIT] and cover(tables.book, parts, search.scratch, left, tallies[LIMIT], 1 << 60) == YES:
        last = begun
        for r in range(len(state)):
            time = tables.book[parts[r, ROW], parts[r, SHARE]]
            if time > 0:
                last = max(last, parts[r, FROM] + time)
            search.shares[r] = parts[r, SHARE]
        tallies[LIMIT] = last
        tallies[FOUND] = level + 1
        for i in range(1, level + 1):
            for k in range(7):
                search.best[i, k] = search.path[i, k]


@compiled
def _branch(tables: Tables, search: Search, level: int) -> None:
    """List the docks and undocks that can follow."""
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
                _list(tables, search, level, c, v, m)


@compiled
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


@compiled
def _list(tables: Tables, search: Search, level: int, c: int, v: int, m: int) -> None:
    """List the docks or undocks of a rover on a carrier at a meeting, for all sets of targets explored before."""
    state = search.states[level]
    left, limit = search.levels[level, LEFT], search.tallies[LIMIT]
    there = tables.way[tables.traits[c, KIND], state[c, WHERE]]
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
                    _add(search, level, comes + takes, v, c, m, own, 0, 1)
            else:
                _list_docks(tables, search, level, c, v, m, own, able, comes)
        if not own:
            return
        own = (own - 1) & able


@compiled
def _wider(way: Ints, explored: int, able: int, m: int, since: int, time: int) -> bool:
    """Say whether one more target could be explored without being at the meeting after `time`."""
    rest = able & ~explored
    while rest:
        bit = rest & -rest
        if since + way[explored | bit, m] <= time:
            return True
        rest ^= bit
    return False


@compiled
def _list_docks(
    tables: Tables, search: Search, level: int, c: int, v: int, m: int, own: int, own_able: int, comes: int
) -> None:
    """List the docks of a rover on a carrier that comes after exploring the set `own` out of `own_able`."""
    state = search.states[level]
    left, limit = search.levels[level, LEFT], search.tallies[LIMIT]
    there = tables.way[tables.traits[c, KIND], state[c, WHERE]]
    way = tables.way[tables.traits[v, KIND], state[v, WHERE]]
    if way[0, m] >= NEVER:
        return
    takes = tables.traits[v, DOCKS]
    able = left & tables.able[tables.traits[v, KIND]] & ~own
    brought = able
    while True:
        time = max(comes, state[v, SINCE] + way[brought, m])
        if (
            time + takes < limit
            and not _wider(way, brought, able, m, state[v, SINCE], time)
            and not _wider(there, own, own_able & ~brought, m, state[c, SINCE], time)
        ):
            _add(search, level, time + takes, v, c, m, own, brought, 0)
        if not brought:
            return
        brought = (brought - 1) & able


@compiled
def _add(search: Search, level: int, time: int, v: int, c: int, m: int, own: int, brought: int, down: int) -> None:
    """List an event unless it ends before the last one."""
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
    events[at, END], events[at, ROVER], events[at, CARRIER], events[at, AT] = key, v, c, m
    events[at, OWN], events[at, BROUGHT], events[at, DOWN] = own, brought, down
    search.levels[level + 1, FIRST] = at + 1


@compiled
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
