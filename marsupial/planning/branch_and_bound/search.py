"""Depth-first branch and bound over docks and undocks, whose end proves that no shorter plan exists.

What is searched. To the checker a plan is one list of actions per robot, docks and undocks being in two of them, each
of which can begin as soon as its robots are ready: begun then, in any order that keeps the lists, a plan is as good as
before. What a robot does between two of its docks and undocks concerns no other robot but for the targets explored. So
a state is: the targets left, where each robot is (or on which) since its last dock or undock, and when it was ready.
One step is a dock or an undock, and with it the sets of targets that its carrier and (before a dock) its rover have
explored on the way there; tours over sets are shortest ones, on the closure of the legs (`tables`). After the last
step the targets left are shared among the robots on the ground (`cover`). Choosing sets when they matter, instead of
targets one by one, is what keeps the search small: the order of what different robots explore is never looked at.

What is left out, and why no shorter plan is lost:

- States from which the goal can't be reached in time: `pruning`, made of relaxations only.
- Steps that end before the last one did (`KEY`: end, then how many steps ended at that ms). Such a step shares no robot
  with the last one, so it could come before it, with the same result or a better one.
- A set that could be larger without its step ending later: a robot that has explored more has less to do.
- A state no better than one met before: the same robots (or ones like them) at the same places, the same targets left,
  no robot ready earlier, and a key no lower.
- Steps for nothing, where rovers may end on the ground: of plans as short those with the fewest steps are enough. In
  these whoever is picked up is set down again and explores something then, or is picked up again; so does whoever is
  set down, unless that made room for a rover that is picked up later. So there are never more such rovers than targets
  left, and each of them is in time for one of these. There a state is no better than one met before only if that one
  was reached by no more steps.

These do not lose a plan in turns. Call a state that is entered and the steps from it to a plan shorter than all that
are found a way out, its times being delayed to those of the last step where they are earlier. Compare ways out by the
number of their steps and of those that led to their state (where rovers may end on the ground), then by the multiset of
their steps' keys and of their state's key. Were there any, take a least one: it is a plan without a step for nothing,
since there is a way out from the first state for every plan. Its first step is not listed
because it would be delayed: then it could come before some last steps, which gives a way out in which this key is
replaced with lower ones. Or its set could be larger, or its state is no better than one entered: then that one has a
way out with keys no higher and one step less. Or its state is entered: then there is one step less as well.
"""

from __future__ import annotations

import numpy as np

from marsupial.native import inlined, native
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.branching import branch
from marsupial.planning.branch_and_bound.cover import YES, cover
from marsupial.planning.branch_and_bound.errands import BITS
from marsupial.planning.branch_and_bound.memory import BUCKET, entry_size, remember
from marsupial.planning.branch_and_bound.pruning import may_lead_on
from marsupial.planning.branch_and_bound.tables import Tables, done_row
from marsupial.planning.branch_and_bound.tree import Search


def search_of(tables: Tables, limit: int, entries: int, *, keyed: bool = True) -> Search:
    """Return a search for plans shorter than `limit` ms, epsilon included, that remembers so many states."""
    robots, targets = len(tables.traits), len(tables.targets)
    entry = entry_size(robots, tables.carriers)
    tallies = np.zeros(8, dtype=np.int64)
    tallies[col.LIMIT] = limit
    tallies[col.KEYED] = keyed
    tallies[col.LEVEL] = 0
    search = Search(
        states=np.zeros((col.LEVELS, robots, 3), dtype=np.int64),
        levels=np.zeros((col.LEVELS, 4), dtype=np.int64),
        events=np.zeros((col.WIDTH, 7), dtype=np.int64),
        path=np.zeros((col.LEVELS, 7), dtype=np.int64),
        best=np.zeros((col.LEVELS, 7), dtype=np.int64),
        shares=np.zeros(robots, dtype=np.int64),
        parts=np.zeros((robots, 4), dtype=np.int64),
        scratch=np.zeros((4, max(1, targets)), dtype=np.int64),
        tallies=tallies,
        jobs=np.zeros((3, robots + 2 * BITS), dtype=np.int64),
        loads=np.zeros((3, tables.carriers), dtype=np.int64),
        memory=np.zeros((entries, entry), dtype=np.int64),
        order=np.zeros((2, entry), dtype=np.int64),
    )
    search.states[0] = tables.beginning
    search.levels[0, col.LEFT] = (1 << targets) - 1
    enter(tables, search)
    return search


def root_bound_ms(tables: Tables, limit: int) -> int:
    """Return a time no later than `limit` that no plan ends before, epsilon included."""
    search = search_of(tables, 0, BUCKET)
    low, high = 0, limit
    while low < high:
        middle = (low + high + 1) // 2
        search.tallies[col.LIMIT] = middle
        if hopeful(tables, search):
            high = middle - 1
        else:
            low = middle
    return low


@native
def hopeful(tables: Tables, search: Search) -> bool:
    """Say whether there may be plans shorter than the limit."""
    return may_lead_on(tables, search, 0)


@native
def enter(tables: Tables, search: Search) -> None:
    """Enter the first state."""
    _enter(tables, search, 0)


@native
def advance(tables: Tables, search: Search, nodes: int) -> bool:
    """Enter that many nodes; return whether there may be more."""
    tallies, levels = search.tallies, search.levels
    until = tallies[col.NODES] + nodes
    while tallies[col.NODES] < until:
        level = tallies[col.LEVEL]
        if level < 0:
            return False
        at = levels[level, col.NEXT]
        if at == _end(search, level):
            tallies[col.LEVEL] -= 1
            continue
        levels[level, col.NEXT] += 1
        if search.events[at, col.END] // col.TIES >= tallies[col.LIMIT]:
            levels[level, col.NEXT] = _end(search, level)
            continue
        _apply(tables, search, level, at)
        tallies[col.LEVEL] += 1
        tallies[col.NODES] += 1
        _enter(tables, search, level + 1)
    return tallies[col.LEVEL] >= 0


@inlined
def _end(search: Search, level: int) -> int:
    return search.levels[level + 1, col.FIRST]


@inlined
def _apply(tables: Tables, search: Search, level: int, at: int) -> None:
    events = search.events
    old, state = search.states[level], search.states[level + 1]
    for r in range(len(state)):
        for k in range(3):
            state[r, k] = old[r, k]
    for k in range(7):
        search.path[level + 1, k] = events[at, k]
    v, c = events[at, col.ROVER], events[at, col.CARRIER]
    base = tables.meetings[events[at, col.AT]]
    time = events[at, col.END] // col.TIES
    state[c, col.WHERE], state[c, col.SINCE] = base, time
    if events[at, col.DOWN]:
        state[v, col.WHERE], state[v, col.ON], state[v, col.SINCE] = base, -1, time
    else:
        state[v, col.WHERE], state[v, col.ON], state[v, col.SINCE] = -1, c, 0
    search.levels[level + 1, col.LEFT] = search.levels[level, col.LEFT] & ~(
        events[at, col.OWN] | events[at, col.BROUGHT]
    )
    search.levels[level + 1, col.KEY] = events[at, col.END]


@inlined
def _enter(tables: Tables, search: Search, level: int) -> None:
    """Prune the state of a level, or look whether it is the end of a plan and list the events that can follow."""
    levels, tallies = search.levels, search.tallies
    first = levels[level, col.FIRST]
    levels[level, col.NEXT] = first
    levels[level + 1, col.FIRST] = first
    if not may_lead_on(tables, search, level):
        tallies[col.BOUND] += 1
        return
    left, key = levels[level, col.LEFT], levels[level, col.KEY]
    steps = 0 if tables.recover or not tallies[col.KEYED] else level
    if remember(tables, search.memory, search.order, search.states[level], left, key, steps):
        tallies[col.SEEN] += 1
        return
    _complete(tables, search, level)
    if level + 2 >= col.LEVELS:
        tallies[col.LOST] = 1
        return
    branch(tables, search, level)


@inlined
def _complete(tables: Tables, search: Search, level: int) -> None:
    """If no dock or undock has to follow, note the plan in which none follows, and shorter ones of that kind."""
    state, parts, tallies = search.states[level], search.parts, search.tallies
    left = search.levels[level, col.LEFT]
    for r in range(len(state)):
        parts[r, col.MAY] = left
        parts[r, col.FROM] = state[r, col.SINCE]
        if state[r, col.ON] >= 0:
            parts[r, col.ROW] = len(tables.book) - 1
        else:
            if r >= tables.carriers and tables.recover:
                return
            parts[r, col.ROW] = done_row(tables, tables.traits[r, col.TWIN], state[r, col.WHERE])
    begun = search.levels[level, col.KEY] // col.TIES
    while (
        begun < tallies[col.LIMIT]
        and cover(tables.book, parts, search.scratch, left, tallies[col.LIMIT], 1 << 60) == YES
    ):
        last = begun
        for r in range(len(state)):
            time = tables.book[parts[r, col.ROW], parts[r, col.SHARE]]
            if time > 0:
                last = max(last, parts[r, col.FROM] + time)
            search.shares[r] = parts[r, col.SHARE]
        tallies[col.LIMIT] = last
        tallies[col.FOUND] = level + 1
        for i in range(1, level + 1):
            for k in range(7):
                search.best[i, k] = search.path[i, k]
