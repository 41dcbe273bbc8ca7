"""Which robots are in contact: carriers, the rovers near them, and the rovers near rovers in contact."""

import math
from collections.abc import Collection, Mapping
from typing import Protocol

from marsupial.model import Cell


class Transmitter(Protocol):
    """A robot with a radio."""

    name: str
    cell: Cell | None
    partner: str | None  # the robot that it docks with, or is undocked by
    lost: bool


def in_contact(robots: Collection[Transmitter], ranges_cells: Mapping[str, float]) -> frozenset[str]:
    """Return the robots in contact; those without a range are always. Lost robots pass nothing on."""
    apart = {one.name: one for one in robots if one.name in ranges_cells and one.cell and one.partner is None}
    relays = [one.cell for one in robots if one.name not in apart and one.cell and not one.lost]
    while apart and relays:
        here = relays.pop()
        for one in [one for one in apart.values() if one.cell and math.dist(one.cell, here) <= ranges_cells[one.name]]:
            del apart[one.name]
            if one.cell and not one.lost:
                relays.append(one.cell)
    return frozenset(one.name for one in robots if one.name not in apart)
