"""Depth-first branch and bound over docks and undocks; when it ends, no shorter plan exists.

Theory of operation
-------------------
**State.** To the checker a plan is one list of actions per robot; a dock or an undock is in two lists. Starting each
action as soon as its robots are ready gives the shortest plan for these lists. Between two of its docks and undocks a
robot affects the others only by the targets that it explores. So a state is: the targets left, where each robot is (or
on which carrier) since its last dock or undock, and since when it is ready.

**Branching.** A step is one dock or undock, together with the sets of targets that its carrier and (before a dock) its
rover explore on the way there. Tours over sets are looked up: the shortest ones, on the metric closure (`tables`). From
every state the search also tries to end the plan: the targets left are shared among the robots on the ground (`cover`).
Choosing whole sets when they matter, and not targets one by one, keeps the tree small: the order in which different
robots explore is never branched on.

The tree is walked depth first, with one frame per level. All events waiting are in one array, level after level:

    level     0             1             2
    states    root -------> after a ----> after a, d          (the path is: a, d)
    events  | a b c       | d e         | f g h               FIRST of a level: where its events begin
              ^ entered     ^ entered     ^ NEXT              NEXT: the event to try next, in the order of ends

Backtracking is one step back in `LEVEL`; the events of the levels above are still there.

**Bounds.** A plan found lowers the limit, and only shorter plans count from then on. A state is pruned if a relaxation
shows that it can't lead to the goal within the limit (`pruning`): rovers are carried at any time, or carriers need only
the least docks, undocks and visits. A relaxation allows all that plans may do, so no plan is lost.

**Dominance.** The search also skips:

- Steps that end before the last one did (`KEY`: its end, then the number of steps that ended at that ms). Such a step
  shares no robot with the last one, so it could come before it, with the same result or a better one.
- Sets that could be larger without the step ending later: a robot that has explored more has less left to do.
- States no better than one entered before (`memory`): the same robots, or interchangeable ones, at the same places, the
  same targets left, no robot ready earlier, and a key no lower.
- Steps of a rover that has an interchangeable one before it in the same position: the step of the first one gives the
  same state but for their names.
- Useless steps, where rovers may end on the ground. Among the plans of one length those with the fewest steps suffice.
  In them, a rover that is picked up is set down again and then explores or is picked up again. A rover that is set down
  explores or is picked up again, too, unless setting it down made room for a rover picked up later. So there are never
  more such rovers than targets left, and each of them is in time for one of these. Where rovers may end on the ground,
  a state is dominated only by one that was reached in no more steps.

**Why the end is a proof.** The rules could lose a plan together even if none does alone; this is why they don't. Call a
state that was entered, with steps from it to a plan shorter than all found, a *completion*; where its times are earlier
than the last step, delay them to it. Order completions by the number of their steps and of those that led to
their state (where rovers may end on the ground), then by the multiset of the keys of their steps and their state.
Suppose that the search has ended and there is a completion; take a least one. It has no useless step, as every plan
gives a completion from the root. It has a step, as the shortest plan without one was found when its state was entered.
Look at its first step:

- It was not listed because it would be delayed. Then it could come before some of the last steps. That gives a
  completion in which its key is replaced with lower ones: a contradiction.
- It was not listed because its set could be larger, or its state is dominated by one entered. Then that state has a
  completion with keys no higher and one step fewer: a contradiction.
- It was not listed because an interchangeable rover comes first. Then exchange the two in the completion, which changes
  neither keys nor the number of steps, and look at that step instead.
- Its state was entered. Then its completion has one step fewer: a contradiction.

So there is none: the last plan found is optimal. If the search ran out of space (`INCOMPLETE`), nothing is proven.
"""

import numpy as np

from marsupial.native import inlined, native
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.branching import branch
from marsupial.planning.branch_and_bound.columns import SearchState
from marsupial.planning.branch_and_bound.cover import YES, cover
from marsupial.planning.branch_and_bound.errands import BITS
from marsupial.planning.branch_and_bound.memory import BUCKET, entry_size, is_dominated
from marsupial.planning.branch_and_bound.pruning import may_lead_to_plan
from marsupial.planning.branch_and_bound.tables import Tables, alone_row


def search_of(tables: Tables, limit: int, entries: int, *, keyed: bool = True) -> SearchState:
    """Return a search for plans shorter than `limit` ms, epsilon included, with a memory of `entries` states."""
    robots, targets = len(tables.traits), len(tables.targets)
    entry = entry_size(robots, tables.carriers)
    counters = np.zeros(8, dtype=np.int64)
    counters[col.LIMIT] = limit
    counters[col.KEYED] = keyed
    search = SearchState(
        states=np.zeros((col.MOST_LEVELS, robots, 3), dtype=np.int64),
        levels=np.zeros((col.MOST_LEVELS, 4), dtype=np.int64),
        events=np.zeros((col.MOST_EVENTS, 7), dtype=np.int64),
        path=np.zeros((col.MOST_LEVELS, 7), dtype=np.int64),
        best=np.zeros((col.MOST_LEVELS, 7), dtype=np.int64),
        shares=np.zeros(robots, dtype=np.int64),
        assignments=np.zeros((robots, 4), dtype=np.int64),
        scratch=np.zeros((4, max(1, targets)), dtype=np.int64),
        counters=counters,
        jobs=np.zeros((3, robots + 2 * BITS), dtype=np.int64),
        loads=np.zeros((3, tables.carriers), dtype=np.int64),
        memory=np.zeros((entries, entry), dtype=np.int64),
        order=np.zeros((2, entry), dtype=np.int64),
    )
    search.states[0] = tables.root_state
    search.levels[0, col.LEFT] = (1 << targets) - 1
    enter(tables, search)
    return search


def root_bound_ms(tables: Tables, limit: int) -> int:
    """Return a lower bound on the makespan, at most `limit`, epsilon included: the bound of the root, by bisection."""
    # Only the root is evaluated, so the smallest memory suffices.
    search = search_of(tables, 0, BUCKET)
    low, high = 0, limit
    while low < high:
        middle = (low + high + 1) // 2
        search.counters[col.LIMIT] = middle
        if may_have_plan(tables, search):
            high = middle - 1
        else:
            low = middle
    return low


@native
def may_have_plan(tables: Tables, search: SearchState) -> bool:
    """Return whether plans shorter than the limit are possible, judged at the root."""
    return may_lead_to_plan(tables, search, 0)


@native
def enter(tables: Tables, search: SearchState) -> None:
    _enter(tables, search, 0)


@native
def advance(tables: Tables, search: SearchState, nodes: int) -> bool:
    """Enter `nodes` states; return whether there may be more."""
    counters, levels = search.counters, search.levels
    until = counters[col.NODES] + nodes
    while counters[col.NODES] < until:
        level = counters[col.LEVEL]
        if level < 0:
            return False
        at = levels[level, col.NEXT]
        end = levels[level + 1, col.FIRST]
        if at == end:
            counters[col.LEVEL] -= 1
            continue
        levels[level, col.NEXT] += 1
        # The limit may have dropped since the events were listed. They are sorted: the others are too late as well.
        if search.events[at, col.END] // col.KEY_SCALE >= counters[col.LIMIT]:
            levels[level, col.NEXT] = end
            continue
        _apply(tables, search, level, at)
        counters[col.LEVEL] += 1
        counters[col.NODES] += 1
        _enter(tables, search, level + 1)
    return counters[col.LEVEL] >= 0


@inlined
def _apply(tables: Tables, search: SearchState, level: int, at: int) -> None:
    levels, events = search.levels, search.events
    old, state = search.states[level], search.states[level + 1]
    for r in range(len(state)):
        for k in range(3):
            state[r, k] = old[r, k]
    for k in range(7):
        search.path[level + 1, k] = events[at, k]
    v, c = events[at, col.ROVER], events[at, col.CARRIER]
    base = tables.meetings[events[at, col.AT]]
    time = events[at, col.END] // col.KEY_SCALE
    state[c, col.WHERE], state[c, col.SINCE] = base, time
    if events[at, col.DOWN]:
        state[v, col.WHERE], state[v, col.ON], state[v, col.SINCE] = base, -1, time
    else:
        # Aboard, a rover is ready when its carrier is; 0 makes such states equal.
        state[v, col.WHERE], state[v, col.ON], state[v, col.SINCE] = -1, c, 0
    levels[level + 1, col.LEFT] = levels[level, col.LEFT] & ~(events[at, col.OWN] | events[at, col.BROUGHT])
    levels[level + 1, col.KEY] = events[at, col.END]


@inlined
def _enter(tables: Tables, search: SearchState, level: int) -> None:
    """Prune the state of a level, or complete a plan from it if possible and list the events that can follow."""
    levels, counters = search.levels, search.counters
    first = levels[level, col.FIRST]
    levels[level, col.NEXT] = first
    levels[level + 1, col.FIRST] = first
    if not may_lead_to_plan(tables, search, level):
        counters[col.PRUNED] += 1
        return
    left, key = levels[level, col.LEFT], levels[level, col.KEY]
    # The number of steps matters only where useless steps are pruned.
    steps = 0 if tables.recover or not counters[col.KEYED] else level
    if is_dominated(tables, search.memory, search.order, search.states[level], left, key, steps):
        counters[col.DUPLICATES] += 1
        return
    # Before branching: a plan found here lowers the limit for all later states.
    _close_plan(tables, search, level)
    if level + 2 >= col.MOST_LEVELS:
        counters[col.INCOMPLETE] = 1
        return
    branch(tables, search, level)


@inlined
def _close_plan(tables: Tables, search: SearchState, level: int) -> None:
    """If no dock or undock has to follow, store the shortest plan in which none does, if it is below the limit."""
    state, assignments, counters = search.states[level], search.assignments, search.counters
    left = search.levels[level, col.LEFT]
    for r in range(len(state)):
        assignments[r, col.ALLOWED] = left
        assignments[r, col.READY] = state[r, col.SINCE]
        if state[r, col.ON] >= 0:
            assignments[r, col.ROW] = len(tables.solo_times) - 1
        else:
            if r >= tables.carriers and tables.recover:
                return
            assignments[r, col.ROW] = alone_row(tables, tables.traits[r, col.TWIN], state[r, col.WHERE])
    begun = search.levels[level, col.KEY] // col.KEY_SCALE
    # Each plan found lowers the limit; the last one is the shortest that ends here.
    while (
        begun < counters[col.LIMIT]
        and cover(tables.solo_times, assignments, search.scratch, left, counters[col.LIMIT], 1 << 60) == YES
    ):
        last = begun
        for r in range(len(state)):
            time = tables.solo_times[assignments[r, col.ROW], assignments[r, col.SHARE]]
            if time > 0:
                last = max(last, assignments[r, col.READY] + time)
            search.shares[r] = assignments[r, col.SHARE]
        counters[col.LIMIT] = last
        counters[col.FOUND] = level + 1
        for i in range(1, level + 1):
            for k in range(7):
                search.best[i, k] = search.path[i, k]
