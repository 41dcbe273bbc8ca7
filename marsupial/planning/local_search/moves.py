"""The neighbourhood of annealing: a table of its moves with the rate of each, and the function that applies one.

A move is a compiled function of a linked schedule. It draws what it needs, changes links and returns whether it changed
anything. It need not check that the result is feasible or better: timing decides, and undoing is cheap (a few logged
rows). So moves are short, and check only that the chains stay well formed, or conditions that fail often and are cheap
to test.

Three kinds, each in a file of its own:

    target_moves     targets go to another robot or sortie, with the transfers that serve them alone; sorties swap
    transfer_moves   docks and undocks go to another place, position in the route, or carrier; sorties merge
    route_moves      parts of carriers' routes are moved, exchanged or reversed (Or-opt, cross-exchange, 2-opt)

About half of the choices are guided (`choices`): a node on the chain of events that something late waits for, a target
near another one, the position of the least detour. The other half are uniform, so that every change stays possible.
"""

from typing import NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import route_moves, target_moves, transfer_moves
from marsupial.planning.local_search.linked_schedule import LinkedSchedule


class Move(NamedTuple):
    """How often a move is tried, beside the others; `busy_rate` where there are many transfers."""

    name: str
    rate: int
    busy_rate: int


# in the order of their numbers in `apply_move`
MOVES = (
    Move("relocate", 20, 10),
    Move("deploy", 20, 12),
    Move("swap", 8, 4),
    Move("reverse", 6, 3),
    Move("move meeting", 5, 2),
    Move("reorder", 16, 24),
    Move("reassign", 10, 24),
    Move("merge", 3, 2),
    Move("swap transfers", 6, 12),
    Move("swap sorties", 10, 12),
    Move("move string", 10, 12),
    Move("cross-exchange", 8, 12),
    Move("splice", 4, 4),
    Move("swap tails", 6, 1),
    Move("invert", 6, 10),
)

BUSY = 60  # busy rates hold from this number of transfers in the first plans on, if there is one per target


def cumulative_rates(*, busy: bool) -> Ints:
    """Return (moves,): a move is made if the number drawn is below its entry and not below the one before."""
    return np.cumsum([move.busy_rate if busy else move.rate for move in MOVES], dtype=np.int64)


# A chain of comparisons: numba can't index a tuple of different functions, and calling them by pointer costs more time.
@inlined
def apply_move(sched: LinkedSchedule, number: int) -> bool:
    """Make the move of a number in the table; return whether it changed anything."""
    has_targets = sched.groups[col.TARGETS, 0] > 0
    changed = False
    if number == 0:
        changed = has_targets and target_moves.relocate(sched)
    elif number == 1:
        changed = has_targets and target_moves.deploy(sched)
    elif number == 2:
        changed = has_targets and target_moves.swap(sched)
    elif number == 3:
        changed = has_targets and target_moves.reverse(sched)
    elif number == 4:
        changed = transfer_moves.move_meeting(sched)
    elif number == 5:
        changed = transfer_moves.reorder(sched)
    elif number == 6:
        changed = transfer_moves.reassign(sched)
    elif number == 7:
        changed = transfer_moves.merge(sched)
    elif number == 8:
        changed = transfer_moves.swap_transfers(sched)
    elif number == 9:
        changed = has_targets and target_moves.swap_sorties(sched)
    elif number == 10:
        changed = route_moves.move_string(sched)
    elif number == 11:
        changed = route_moves.cross_exchange(sched)
    elif number == 12:
        changed = has_targets and route_moves.splice(sched)
    elif number == 13:
        changed = transfer_moves.swap_tails(sched)
    elif number == 14:
        changed = route_moves.invert(sched)
    return changed
