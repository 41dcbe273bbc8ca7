"""The routes of a robot type and their lengths: shortest, or of least energy.

Planning and driving use the same search, so planned lengths hold for the routes driven. Only the heading of a robot at
a place it has not reached yet is unknown to planning, which then takes its first step without a turn.
"""

from collections.abc import Sequence
from typing import Protocol

from marsupial.arrays import Floats, Ints
from marsupial.model import Cell, Mask, RobotType, Routes
from marsupial.model.feed import Feed
from marsupial.paths.energy import EnergySearch, costs_of
from marsupial.paths.fields import PathSearch, SearchMemory
from marsupial.paths.routes import Route


class Ways(Protocol):
    """Finds routes on one mask (height, width), which may change between calls; a heading is a step digit or None."""

    passable: Mask

    def lengths(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None = None) -> Floats:
        """Return the lengths (n,) in cells of the routes from a cell to n others; inf without a route."""

    def matrix(self, cells: Sequence[Cell], headings: Sequence[int | None] | None = None) -> Floats:
        """Return the lengths (k, k) in cells of the routes between all `cells`; inf without a route."""

    def route(self, start: Cell, goal: Cell, heading: int | None = None) -> Route | None:
        """Return the route, both ends included, always the same one; None if there is no route."""


def ways_of(
    kind: RobotType, passable: Mask, resolution_m: float, opened: Feed | None = None, memory: SearchMemory | None = None
) -> Ways:
    """Return the search for a robot type's routes (UsageError: least energy, but driving uses no energy)."""
    if kind.routes is Routes.ENERGY:
        return EnergySearch(passable, costs_of(kind, resolution_m), diagonal=kind.diagonal)
    return PathSearch(passable, kind.diagonal, opened, memory)
