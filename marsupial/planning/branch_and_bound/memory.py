"""A bounded memory of the states entered, to recognise those that are dominated.

A hash table of buckets. A state is put in canonical form first: interchangeable robots are sorted, so that states that
differ only in the names of robots become equal. The key of the table encodes the position of all robots and the targets
left; times are compared one by one. A full bucket loses an entry: that costs time, but never a plan.
"""

import numpy as np

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.branch_and_bound import columns as col
from marsupial.planning.branch_and_bound.tables import Tables

BUCKET = 16
CODE_BITS, SET_BITS = 6, 12
CODES_PER_WORD = 10  # codes of rovers' positions per word

MAX_CARRIERS, MAX_ROVERS, MAX_CODES, MAX_TARGETS = 8, 24, 1 << CODE_BITS, SET_BITS


def entry_size(robots: int, carriers: int) -> int:
    """Return the size of an entry for a number of robots, the carriers among them."""
    return _words(robots, carriers) + robots + 2


@inlined
def _words(robots: int, carriers: int) -> int:
    return 1 + max(1, -(-(robots - carriers) // CODES_PER_WORD))


@inlined
def is_dominated(tables: Tables, memory: Ints, order: Ints, state: Ints, left: int, key: int, steps: int) -> bool:
    """Return whether a state is dominated by one in memory; if not, store it.

    An entry of `memory`, free if 0, has words that code where all robots are and which targets are left, when each
    robot is ready, the key of the last event, and the number of events so far if that counts (`steps`). `order` is
    scratch.
    """
    robots, carriers = len(state), tables.carriers
    words = _words(robots, carriers)
    # Carriers first: the codes of rovers aboard refer to their ranks.
    ranks, entry = order[0], order[1]
    for r in range(carriers):
        _insert_by_rank(tables, ranks, state, 0, r, carriers)
    entry[0] = left + 1
    for i in range(carriers):
        c = ranks[i]
        entry[0] |= state[c, col.WHERE] << (SET_BITS + 1 + CODE_BITS * i)
        entry[words + i] = state[c, col.SINCE]
    for r in range(carriers, robots):
        _insert_by_rank(tables, ranks, state, carriers, r, carriers)
    # A leading 1 keeps these words from being 0, which marks a free entry.
    entry[1:words] = 1
    for i in range(carriers, robots):
        v, word = ranks[i], 1 + (i - carriers) // CODES_PER_WORD
        entry[word] = entry[word] << CODE_BITS | _place_code(tables, ranks, state, v)
        entry[words + i] = 0 if state[v, col.ON] >= 0 else state[v, col.SINCE]
    entry[words + robots], entry[words + robots + 1] = key, steps
    return _find_or_store(memory, entry, words)


@inlined
def _place_code(tables: Tables, ranks: Ints, state: Ints, v: int) -> int:
    if state[v, col.ON] < 0:
        return state[v, col.WHERE]
    for i in range(tables.carriers):
        if ranks[i] == state[v, col.ON]:
            return len(tables.bases) + i
    return -1


@inlined
def _insert_by_rank(tables: Tables, ranks: Ints, state: Ints, first: int, r: int, carriers: int) -> None:
    """Insert robot `r` into the canonical order, among those that it is interchangeable with."""
    at = r
    while at > first and _ranks_before(tables, ranks, state, r, ranks[at - 1], carriers):
        ranks[at] = ranks[at - 1]
        at -= 1
    ranks[at] = r


@inlined
def _ranks_before(tables: Tables, ranks: Ints, state: Ints, one: int, other: int, carriers: int) -> bool:
    if tables.traits[one, col.TWIN] != tables.traits[other, col.TWIN]:
        return False
    if one < carriers:
        a, b = state[one, col.WHERE], state[other, col.WHERE]
        if a == b:
            a, b = _rovers_aboard(tables, state, one), _rovers_aboard(tables, state, other)
    else:
        a, b = _place_code(tables, ranks, state, one), _place_code(tables, ranks, state, other)
    return a < b or (a == b and state[one, col.SINCE] < state[other, col.SINCE])


@inlined
def _rovers_aboard(tables: Tables, state: Ints, c: int) -> int:
    cargo = 0
    for v in range(tables.carriers, len(state)):
        if state[v, col.ON] == c:
            cargo += 1 << 3 * min(tables.traits[v, col.TWIN] - tables.carriers, 20)
    return cargo


@inlined
def _find_or_store(memory: Ints, entry: Ints, words: int) -> bool:
    width = memory.shape[1]
    x = np.uint64(entry[0]) * np.uint64(0x9E3779B97F4A7C15)
    for k in range(1, words):
        x ^= np.uint64(entry[k]) * np.uint64(0xC2B2AE3D27D4EB4F)
        x ^= x >> np.uint64(29)
        x *= np.uint64(0xBF58476D1CE4E5B9)
    x ^= x >> np.uint64(32)
    # Only words that have to be equal are hashed, so states that may dominate each other are in one bucket.
    first = int(x % np.uint64(len(memory) // BUCKET)) * BUCKET
    free = -1
    for i in range(first, first + BUCKET):
        row = memory[i]
        if row[1] == 0:
            if free < 0:
                free = i
            break
        same = better = worse = True
        for k in range(words):
            same = same and row[k] == entry[k]
        if not same:
            continue
        for k in range(words, width):
            if row[k] > entry[k]:
                better = False
            elif row[k] < entry[k]:
                worse = False
        if better:
            return True
        # The new state dominates this one, so it can take its place.
        if worse and free < 0:
            free = i
    if free < 0:
        free = first + int(((x >> np.uint64(40)) ^ np.uint64(entry[width - 1])) % np.uint64(BUCKET))
    for k in range(width):
        memory[free, k] = entry[k]
    return False
