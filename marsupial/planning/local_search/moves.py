"""The neighbourhood moves of annealing: a table of what there is and how often each is tried."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from marsupial.arrays import Ints
from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import route_moves, sortie_moves, target_moves, transfer_moves
from marsupial.planning.local_search.net import Net


class Move(NamedTuple):
    """A move: compiled, it changes a net at random and says whether it did.

    Attributes
    ----------
    rate, busy_rate
        How often it is tried, beside the others; the second where there are many transfers.
    needs_targets
        Whether it can be tried only where there are targets.
    """

    name: str
    change: Callable[[Net], bool]
    rate: int
    busy_rate: int
    needs_targets: bool = False


MOVES = (
    Move("relocate", target_moves.relocate, 20, 10, needs_targets=True),
    Move("deploy", target_moves.deploy, 20, 12, needs_targets=True),
    Move("swap", target_moves.swap, 8, 4, needs_targets=True),
    Move("reverse", target_moves.reverse, 6, 3, needs_targets=True),
    Move("move meeting", transfer_moves.move_meeting, 5, 2),
    Move("reorder", transfer_moves.reorder, 16, 24),
    Move("reassign", transfer_moves.reassign, 10, 24),
    Move("merge", transfer_moves.merge, 3, 2),
    Move("swap transfers", transfer_moves.swap_transfers, 6, 12),
    Move("swap sorties", sortie_moves.swap_sorties, 10, 12, needs_targets=True),
    Move("move string", route_moves.move_string, 10, 12),
    Move("cross-exchange", route_moves.cross_exchange, 8, 12),
    Move("splice", route_moves.splice, 4, 4, needs_targets=True),
    Move("swap tails", transfer_moves.swap_tails, 6, 1),
    Move("invert", route_moves.invert, 6, 10),
)

BUSY = 60
"""From how many transfers in a plan to begin with, and one for every target, the busy rates hold."""


def lots(*, busy: bool) -> Ints:
    """Return (moves,): up to which number drawn each move is made."""
    return np.cumsum([move.busy_rate if busy else move.rate for move in MOVES], dtype=np.int64)


def _one_of(moves: Sequence[Move]) -> Callable[[Net, int], bool]:
    """Return a function that makes the move of a number; compiled, it is one chain of comparisons with constants.

    It is written as text, since a function for each link would take a second to compile.
    """
    lines = ["def change(net, move):"]
    for number, move in enumerate(moves):
        if_any = "net.groups[TARGETS, 0] > 0 and " if move.needs_targets else ""
        lines.append(f"    if move == {number}:\n        return {if_any}move{number}(net)")
    names: dict[str, Any] = {f"move{number}": move.change for number, move in enumerate(moves)}
    names["TARGETS"] = col.TARGETS
    exec(compile("\n".join([*lines, "    return False"]), __file__, "exec"), names)
    chain: Callable[[Net, int], bool] = inlined(names["change"])
    return chain


change = _one_of(MOVES)
"""Make the move of a number in the table; say whether it changed anything."""
