"""All random changes, by number."""

from __future__ import annotations

from marsupial.planning.local_search.net import (
    Net,
    compiled,
)
from marsupial.planning.local_search.route_moves import cross, shift, splice, turn_round
from marsupial.planning.local_search.sortie_moves import interchange
from marsupial.planning.local_search.target_moves import deploy, relocate, reverse, swap
from marsupial.planning.local_search.transport_moves import exchange, rehost, remeet, reorder, rideless, trade


@compiled
def change(net: Net, move: int) -> bool:
    """Make the random change of that number."""
    if move == 0:
        return relocate(net)
    if move == 1:
        return deploy(net)
    if move == 2:
        return swap(net)
    if move == 3:
        return reverse(net)
    if move == 4:
        return remeet(net)
    if move == 5:
        return reorder(net)
    if move == 6:
        return rehost(net)
    if move == 7:
        return rideless(net)
    if move == 8:
        return trade(net)
    if move == 9:
        return interchange(net)
    if move == 10:
        return shift(net)
    if move == 11:
        return cross(net)
    if move == 12:
        return splice(net)
    if move == 13:
        return exchange(net)
    return turn_round(net)


NEEDING_TARGETS = 4
"""The moves with lower numbers are about targets."""
