"""The ways that robots of a type take, and how long they are: the shortest, or those of least energy.

Whatever is said of a way at planning holds for the way that is driven, since both come from the same search; only
which way a robot faces at a place that it has yet to get to is not known, and left open.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from marsupial.arrays import Floats, Ints
from marsupial.model.feed import Feed
from marsupial.model.grid import Cell, Mask
from marsupial.model.robots import RobotType, Routes
from marsupial.paths.energy import EnergySearch, costs_of
from marsupial.paths.fields import PathSearch, SearchMemory
from marsupial.paths.routes import Route


class Ways(Protocol):
    """Finds ways on one mask (height, width), `passable`, which may change between calls.

    A heading is the digit of a step; None where a robot faces no way in particular.
    """

    passable: Mask

    def lengths(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None = None) -> Floats:
        """Return the lengths (n,) in cells of the ways from a cell to n others; inf where there is none."""

    def matrix(self, cells: Sequence[Cell], headings: Sequence[int | None] | None = None) -> Floats:
        """Return the lengths (k, k) in cells of the ways from each of `cells` to each; inf where there is none."""

    def route(self, start: Cell, goal: Cell, heading: int | None = None) -> Route | None:
        """Return the way, both ends included, always the same one; None where there is none."""


class ShortestWays:
    """The shortest ways, whichever way a robot faces; see `PathSearch`."""

    def __init__(
        self,
        passable: Mask,
        diagonal: float,
        opened: Feed | None = None,
        memory: SearchMemory | None = None,
    ) -> None:
        self.passable = passable
        self._search = PathSearch(passable, diagonal, opened, memory)

    def lengths(self, source: Cell, wanted: Sequence[Cell] | Ints, heading: int | None = None) -> Floats:
        """Return the lengths of the shortest ways."""
        return self._search.costs(source, wanted)

    def matrix(self, cells: Sequence[Cell], headings: Sequence[int | None] | None = None) -> Floats:
        """Return the lengths of the shortest ways between all."""
        return self._search.matrix(cells)

    def route(self, start: Cell, goal: Cell, heading: int | None = None) -> Route | None:
        """Return a shortest way."""
        return self._search.route(start, goal)


def ways_of(
    kind: RobotType,
    passable: Mask,
    resolution_m: float,
    opened: Feed | None = None,
    memory: SearchMemory | None = None,
) -> Ways:
    """Return what finds the ways of a robot type; `opened` and `memory` are told at `PathSearch`.

    Raises
    ------
    UsageError
        If it is to take those of least energy and drives without any.
    """
    if kind.routes is Routes.ENERGY:
        return EnergySearch(passable, costs_of(kind, resolution_m), diagonal=kind.diagonal)
    return ShortestWays(passable, kind.diagonal, opened, memory)
