"""What every robot drives and sees, to be changed stop by stop: what both repairing and shortening work on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

from marsupial.model.grid import Cell
from marsupial.model.plan import Action, ActionName
from marsupial.strategies.clairvoyant.cover import stop_at
from marsupial.strategies.clairvoyant.ground import Cells
from marsupial.strategies.clairvoyant.outline import Chain, Outline, Stop


@dataclass(slots=True)
class Way:
    """A chain that can be changed.

    `after` has, per place, the last errand there; None where the chain begins or ends. `seen` has what is seen at the
    first place and then on each leg.
    """

    robot: str
    kind: str
    names: list[str]
    cells: list[Cell]
    after: list[Action | None]
    seen: list[Cells]

    def ends_aboard(self) -> bool:
        """Say whether the robot is picked up at the last place."""
        return len(self.names) > 1 and self.after[-1] is None


class Ways:
    """The chains of an outline, its stops and errands."""

    def __init__(self, outline: Outline) -> None:
        self.ground = outline.ground
        self.all = [_way(outline, chain) for chain in outline.chains]
        self._outline = outline
        self._errands = list(outline.errands)
        self._names = {stop.name for stop in outline.stops}
        self._dropped: set[str] = set()
        self._changed: dict[str, tuple[str, Cell, Cells]] = {}

    @property
    def missed(self) -> Cells:
        """What nobody comes to see."""
        missed = self.ground.wanted
        for way in self.all:
            for seen in way.seen:
                missed &= ~seen
        return missed

    def find(self, name: str) -> tuple[Way, int] | None:
        """Return the way that leads to a stop, and its number on it."""
        return next(((way, way.names.index(name)) for way in self.all if name in way.names), None)

    def own(self, way: Way, at: int) -> Cells:
        """Return what only the legs to and from a stop see.

        For the only stop of a rover that was set down it is what only that rover sees on its whole way: without a stop
        there is no reason to set it down.
        """
        if self.is_only_stop(way, at):
            return self._own(way, range(len(way.seen)))
        return self._own(way, range(at, min(at + 2, len(way.seen))))

    def _own(self, way: Way, legs: range) -> Cells:
        own = 0
        for leg in legs:
            own |= way.seen[leg]
        own &= self.ground.wanted
        for other in self.all:
            for leg, seen in enumerate(other.seen):
                if other is not way or leg not in legs:
                    own &= ~seen
        return own

    def is_only_stop(self, way: Way, at: int) -> bool:
        """Say whether a stop is the only one of a rover that was set down."""
        first = way.after[0]
        set_down = first is not None and first.name is ActionName.UNDOCK and first.robot == way.robot
        return set_down and at == 1 and len(way.names) - way.ends_aboard() == 2

    def drop(self, way: Way, at: int) -> None:
        """Take a stop out."""
        self._dropped.add(way.names[at])
        self._errands = [errand for errand in self._errands if errand is not way.after[at]]
        del way.names[at], way.cells[at], way.after[at]
        del way.seen[at]
        if at < len(way.seen):
            way.seen[at] = self.leg(way, way.cells[at - 1], way.cells[at])

    def move(self, way: Way, at: int, cell: Cell, cells: Cells) -> None:
        """Put a stop elsewhere, from where these cells are to be seen."""
        way.cells[at] = cell
        self._see_around(way, at)
        self._changed[way.names[at]] = (way.kind, cell, cells)

    def insert(self, way: Way, at: int, cell: Cell, cells: Cells) -> None:
        """Put a new stop, from where these cells are to be seen, after place `at` of a way."""
        name = self._new_stop(way.kind, cell, cells)
        errand = Action(name=ActionName.EXPLORE, start_ms=0, duration_ms=0, robot=way.robot, place=name)
        before = way.after[at]
        position = 0 if before is None else next(i for i, e in enumerate(self._errands) if e is before) + 1
        self._errands.insert(position, errand)
        way.names.insert(at + 1, name)
        way.cells.insert(at + 1, cell)
        way.after.insert(at + 1, errand)
        way.seen.insert(at + 1, 0)
        self._see_around(way, at + 1)

    def put_down(self, kind: str, cell: Cell, cells: Cells) -> None:
        """Add a stop that nobody goes to yet."""
        self._new_stop(kind, cell, cells)

    def leg(self, way: Way, *cells: Cell) -> Cells:
        """Return what the robot sees that drives from cell to cell."""
        seen = 0
        for start, goal in pairwise(cells):
            seen |= self.ground.leg(way.kind, start, goal)
        return seen

    def outline(self) -> Outline:
        """Return the outline as it is now."""
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

    def _see_around(self, way: Way, at: int) -> None:
        for leg in (at, at + 1):
            if leg < len(way.cells):
                way.seen[leg] = self.leg(way, way.cells[leg - 1], way.cells[leg])


def _way(outline: Outline, chain: Chain) -> Way:
    ground = outline.ground
    seen = [ground.view(chain.kind, chain.cells[0])]
    seen += [ground.leg(chain.kind, a, b) for a, b in pairwise(chain.cells)]
    after = [None if i is None or i < 0 else outline.errands[i] for i in chain.errands]
    return Way(chain.robot, chain.kind, list(chain.names), list(chain.cells), after, seen)
