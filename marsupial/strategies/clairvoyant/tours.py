"""Editable tours of an outline: repair and shortening insert, move and drop their stops."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

from marsupial.model import Action, ActionName, Cell
from marsupial.strategies.clairvoyant.cover import stop_at
from marsupial.strategies.clairvoyant.ground import Cells
from marsupial.strategies.clairvoyant.outline import Outline, Stop, Tour, missed_by


class Tours:
    """The tours of an outline, its stops and errands."""

    def __init__(self, outline: Outline) -> None:
        self.ground = outline.ground
        self.all = outline.tours()
        self._outline = outline
        self._errands = list(outline.errands)
        self._names = {stop.name for stop in outline.stops}
        self._dropped: set[str] = set()
        self._changed: dict[str, tuple[str, Cell, Cells]] = {}

    @property
    def missed(self) -> Cells:
        """The wanted cells that no robot sees."""
        return missed_by(self.ground, self.all)

    def find(self, name: str) -> tuple[Tour, int] | None:
        """Return the tour of a stop, and the stop's number in it."""
        return next(((tour, tour.names.index(name)) for tour in self.all if name in tour.names), None)

    def own(self, tour: Tour, at: int) -> Cells:
        """Return what only the legs to and from a stop see, or a deployed rover's whole tour to its only stop."""
        if self.is_only_stop(tour, at):  # without it there is no reason to set the rover down
            return self._own(tour, range(len(tour.seen)))
        return self._own(tour, range(at, min(at + 2, len(tour.seen))))

    def _own(self, tour: Tour, legs: range) -> Cells:
        own = 0
        for leg in legs:
            own |= tour.seen[leg]
        own &= self.ground.wanted
        for other in self.all:
            for leg, seen in enumerate(other.seen):
                if other is not tour or leg not in legs:
                    own &= ~seen
        return own

    def is_only_stop(self, tour: Tour, at: int) -> bool:
        """Return whether a stop is the only one of a deployed rover."""
        first = tour.after[0]
        set_down = first is not None and first.name is ActionName.UNDOCK and first.robot == tour.robot
        return set_down and at == 1 and len(tour.names) - tour.ends_aboard() == 2

    def drop(self, tour: Tour, at: int) -> None:
        """Remove a stop."""
        self._dropped.add(tour.names[at])
        self._errands = [errand for errand in self._errands if errand is not tour.after[at]]
        del tour.names[at], tour.cells[at], tour.after[at]
        del tour.seen[at]
        if at < len(tour.seen):
            tour.seen[at] = self.leg(tour, tour.cells[at - 1], tour.cells[at])

    def move(self, tour: Tour, at: int, cell: Cell, cells: Cells) -> None:
        """Move a stop to another cell; the stop is for seeing `cells`."""
        tour.cells[at] = cell
        self._see_around(tour, at)
        self._changed[tour.names[at]] = (tour.kind, cell, cells)

    def insert(self, tour: Tour, at: int, cell: Cell, cells: Cells) -> None:
        """Insert a new stop for seeing `cells` after place `at` of a tour."""
        name = self._new_stop(tour.kind, cell, cells)
        errand = Action(name=ActionName.EXPLORE, start_ms=0, duration_ms=0, robot=tour.robot, place=name)
        # the robot does it right after its last errand at the place before
        before = tour.after[at]
        position = 0 if before is None else next(i for i, e in enumerate(self._errands) if e is before) + 1
        self._errands.insert(position, errand)
        tour.names.insert(at + 1, name)
        tour.cells.insert(at + 1, cell)
        tour.after.insert(at + 1, errand)
        tour.seen.insert(at + 1, 0)
        self._see_around(tour, at + 1)

    def add_stop(self, kind: str, cell: Cell, cells: Cells) -> None:
        """Add a stop that is in no tour yet."""
        self._new_stop(kind, cell, cells)

    def leg(self, tour: Tour, *cells: Cell) -> Cells:
        """Return what the tour's robot sees when it drives from cell to cell."""
        seen = 0
        for start, goal in pairwise(cells):
            seen |= self.ground.leg(tour.kind, start, goal)
        return seen

    def outline(self) -> Outline:
        """Return the changed outline."""
        return replace(self._outline, stops=tuple(self._stops()), errands=tuple(self._errands))

    def _stops(self) -> Iterator[Stop]:
        for stop in self._outline.stops:
            if stop.name not in self._changed and stop.name not in self._dropped:
                yield stop
        for name, (kind, cell, cells) in self._changed.items():
            if name not in self._dropped:
                yield stop_at(self.ground, name, kind, cell, cells)

    def _new_stop(self, kind: str, cell: Cell, cells: Cells) -> str:
        name = next(name for n in range(len(self._names) + 1) if (name := f"v_{n}") not in self._names)
        self._names.add(name)
        self._changed[name] = (kind, cell, cells)
        return name

    def _see_around(self, tour: Tour, at: int) -> None:
        for leg in (at, at + 1):
            if leg < len(tour.cells):
                tour.seen[leg] = self.leg(tour, tour.cells[leg - 1], tour.cells[leg])
