"""Editable tours of an outline: shortened without losing seen cells, and repaired where cells are missed.

To shorten tours, stops without cells of their own are dropped, and the others moved. To repair tours, a missed cell is
drawn at random, and a stop that sees it inserted into a tour: at the site with the least detour cost per missed cell
seen, with some noise. This is repeated until no cell is missed.
"""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.model import Action, ActionName, Cell, Plan
from marsupial.planning.greedy import serve
from marsupial.strategies.clairvoyant.cover import stop_at
from marsupial.strategies.clairvoyant.ground import CellSet
from marsupial.strategies.clairvoyant.outline import Outline, Tour, missed_by

TRIES = 8  # most candidate places that are checked exactly, for each stop
LESS_CELLS = 0.1  # least gain in tour length that justifies a change

LATE = 4.0  # cost of a ms beyond the time limit, relative to a ms of driving
FIXED_MS = 500.0  # cost of a stop in addition to driving: few stops that see much are better than many
NOISE = 0.3  # random variation of costs: the standard deviation of their logarithm
UNSERVED = 4.0  # cost of a stop that no robot can reach, relative to the time limit
SITES = 100  # most sites of a type compared for one cell


class Tours:
    """The tours of an outline, its stops and errands."""

    def __init__(self, outline: Outline) -> None:
        self.ground = outline.ground
        self.all = outline.tours()
        self._outline = outline
        self._errands = list(outline.errands)
        self._names = {stop.name for stop in outline.stops}
        self._dropped: set[str] = set()
        self._changed: dict[str, tuple[str, Cell, CellSet]] = {}

    @property
    def missed(self) -> CellSet:
        """The wanted cells that no robot sees."""
        return missed_by(self.ground, self.all)

    def find(self, name: str) -> tuple[Tour, int] | None:
        """Return the tour of a stop, and the stop's number in it."""
        return next(((tour, tour.names.index(name)) for tour in self.all if name in tour.names), None)

    def own(self, tour: Tour, at: int) -> CellSet:
        """Return what only the legs to and from a stop see, or a deployed rover's whole tour to its only stop."""
        legs = range(at, min(at + 2, len(tour.seen)))
        if self.is_only_stop(tour, at):  # without this stop there is no reason to set the rover down
            legs = range(len(tour.seen))
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
        del tour.names[at], tour.cells[at], tour.after[at], tour.seen[at]
        if at < len(tour.seen):
            tour.seen[at] = self.leg(tour, tour.cells[at - 1], tour.cells[at])

    def move(self, tour: Tour, at: int, cell: Cell, cells: CellSet) -> None:
        """Move a stop to another cell; the stop is for seeing `cells`."""
        tour.cells[at] = cell
        self._see_around(tour, at)
        self._changed[tour.names[at]] = (tour.kind, cell, cells)

    def insert(self, tour: Tour, at: int, cell: Cell, cells: CellSet) -> None:
        """Insert a new stop for seeing `cells` after place `at` of a tour."""
        name = self.add_stop(tour.kind, cell, cells)
        errand = Action(name=ActionName.EXPLORE, start_ms=0, duration_ms=0, robot=tour.robot, place=name)
        # the robot makes this stop right after its last errand at the previous place
        before = tour.after[at]
        position = 0 if before is None else next(i for i, e in enumerate(self._errands) if e is before) + 1
        self._errands.insert(position, errand)
        tour.names.insert(at + 1, name)
        tour.cells.insert(at + 1, cell)
        tour.after.insert(at + 1, errand)
        tour.seen.insert(at + 1, 0)
        self._see_around(tour, at + 1)

    def add_stop(self, kind: str, cell: Cell, cells: CellSet) -> str:
        """Add a stop that is in no tour yet; return its name."""
        name = next(name for n in range(len(self._names) + 1) if (name := f"v_{n}") not in self._names)
        self._names.add(name)
        self._changed[name] = (kind, cell, cells)
        return name

    def leg(self, tour: Tour, *cells: Cell) -> CellSet:
        """Return what the tour's robot sees when it drives from cell to cell."""
        seen = 0
        for start, goal in pairwise(cells):
            seen |= self.ground.leg(tour.kind, start, goal)
        return seen

    def outline(self) -> Outline:
        """Return the changed outline."""
        gone = self._dropped | self._changed.keys()
        stops = [stop for stop in self._outline.stops if stop.name not in gone]
        stops += [stop_at(self.ground, n, *where) for n, where in self._changed.items() if n not in self._dropped]
        return replace(self._outline, stops=tuple(stops), errands=tuple(self._errands))

    def _see_around(self, tour: Tour, at: int) -> None:
        for leg in (at, at + 1):
            if leg < len(tour.cells):
                tour.seen[leg] = self.leg(tour, tour.cells[leg - 1], tour.cells[leg])


def shortened(outline: Outline, passes: int = 2) -> Outline:
    """Return the outline with stops dropped and moved; it sees the same cells."""
    ends = {a.place: a.end_ms for a in outline.plan.actions if a.name is ActionName.EXPLORE}
    # late stops first: cells that other stops also see need not be seen late
    order = sorted(ends, key=lambda name: (-ends[name], name))
    tours = Tours(outline)
    for _ in range(passes):
        order = [name for name in order if _improve(tours, name)]
    return tours.outline()


def _improve(tours: Tours, name: str) -> bool:
    """Drop a stop, or move it if that shortens its tour; return whether it is still there."""
    found = tours.find(name)
    assert found is not None
    tour, at = found
    own = tours.own(tour, at)
    ends = _ends(tour, at)
    passing = tours.ground.view(tour.kind, ends[0]) | tours.leg(tour, *ends)
    # drop the stop if others see its cells, or if driving past suffices and it is not a rover's only stop
    if not own or not (tours.is_only_stop(tour, at) or own & ~passing):
        tours.drop(tour, at)
        return False
    cell = _better(tours, tour, at, own, passing)
    if cell is not None:
        tours.move(tour, at, cell, own)
    return True


def _ends(tour: Tour, at: int) -> tuple[Cell, ...]:
    return (tour.cells[at - 1], *tour.cells[at + 1 : at + 2])


def _better(tours: Tours, tour: Tour, at: int, own: CellSet, passing: CellSet) -> Cell | None:
    """Return a cell from which a stop's own cells are seen with less driving, or None."""
    ground, kind = tours.ground, tour.kind
    before, *after = _ends(tour, at)
    lengths = np.sum([ground.distances(kind, end) for end in (before, *after)], axis=0)
    now = sum(float(ground.apart(kind, end, [tour.cells[at]])[0]) for end in (before, *after))
    needed, views, tries = own & ~passing, ground.site_views(kind), TRIES
    shorter = np.flatnonzero((lengths < now - LESS_CELLS) & ground.may_see(kind, needed))
    for n in shorter[np.argsort(lengths[shorter], kind="stable")].tolist():
        if needed & views[n] != needed:
            continue
        cell = ground.cell(ground.sites[kind][n])
        if not own & ~tours.leg(tour, before, cell, *after):
            return cell
        tries -= 1
        if not tries:
            break
    return None


TourPlace = tuple[Tour, int]  # a tour, and the number of its place after which a stop is inserted

Choice = tuple[float, str, int, TourPlace | None]
"""A site: its cost per missed cell that it sees, its type and number, and where it is inserted, if anywhere."""


def repaired(outline: Outline, rng: np.random.Generator, limit_ms: int) -> Outline:
    """Return the outline with more stops, so that all wanted cells are seen, if possible by `limit_ms`."""
    tours = Tours(outline)
    missed = tours.missed
    if not missed:
        return outline
    repair = _Repair(tours, outline.plan, rng, limit_ms)
    while missed:
        missed &= ~repair.add_stop(missed)
    outline = tours.outline()
    if repair.is_partial:
        plan, left = serve(outline.situation, outline.plan)
        outline = outline.with_plan(plan).without(left)
    return outline


class _Repair:
    """Adds stops to tours."""

    def __init__(self, tours: Tours, plan: Plan, rng: np.random.Generator, limit_ms: int) -> None:
        self._tours, self._rng, self._limit_ms = tours, rng, limit_ms
        self._done_ms: Counter[str] = Counter()
        for action in plan.actions:
            for robot in action.robots:
                self._done_ms[robot] = max(self._done_ms[robot], action.end_ms)
        self.is_partial = False  # whether a stop is not in any tour yet

    def add_stop(self, missed: CellSet) -> CellSet:
        """Add a stop that sees a random missed cell; return the missed cells that it sees."""
        ground, tours = self._tours.ground, self._tours
        cell = ground.drawn(missed, self._rng)
        choices = [
            self._cheapest(kind, sites, missed) for kind in ground.kinds if len(sites := self._sites(kind, cell))
        ]
        _, kind, site, place = min(choices, key=lambda choice: choice[0])
        seen = ground.site_views(kind)[site] & missed
        here = ground.cell(ground.sites[kind][site])
        if place is None:
            tours.add_stop(kind, here, seen)
            self.is_partial = True
        else:
            before = self._length(place[0])
            tours.insert(*place, here, seen)
            longer = self._length(place[0]) - before
            self._done_ms[place[0].robot] += round(longer * ground.ms_per_cell(kind))
        return seen

    def _sites(self, kind: str, cell: Cell) -> Ints:
        """Return the numbers of (some of) the sites of a type that see a cell."""
        ground = self._tours.ground
        near, views = np.flatnonzero(ground.near(kind, cell)), ground.site_views(kind)
        bit = ground.bit_of(cell)
        some = near if len(near) <= SITES else self._rng.choice(near, SITES, replace=False)
        # a random sample may contain no site that sees the cell
        seeing = [n for n in some.tolist() if views[n] & bit] or [n for n in near.tolist() if views[n] & bit]
        return np.array(seeing, dtype=np.int64)

    def _cheapest(self, kind: str, sites: Ints, missed: CellSet) -> Choice:
        views = self._tours.ground.site_views(kind)
        gains = np.array([(views[n] & missed).bit_count() for n in sites.tolist()], dtype=np.float64)
        costs, places = self._insertions(kind, sites)
        costs = (costs + FIXED_MS) / gains * np.exp(NOISE * self._rng.standard_normal(len(sites)))
        n = int(np.argmin(costs))
        return float(costs[n]), kind, int(sites[n]), places[n]

    def _insertions(self, kind: str, sites: Ints) -> tuple[Floats, list[TourPlace | None]]:
        """Return the least cost of inserting each site, in ms, and the place; None if no robot can go there."""
        tours = [tour for tour in self._tours.all if tour.kind == kind]
        places = [(tour, at) for tour in tours for at in range(len(tour.names) - tour.ends_aboard())]
        costs, where = np.full(len(sites), UNSERVED * self._limit_ms), np.full(len(sites), -1)
        for i, (tour, at) in enumerate(places):
            extra = self._detours(tour, at, sites)
            late = self._done_ms[tour.robot] + extra - self._limit_ms
            cost = extra + LATE * np.maximum(0.0, late)
            nearer = cost < costs
            costs[nearer], where[nearer] = cost[nearer], i
        return costs, [None if i < 0 else places[i] for i in where.tolist()]

    def _detours(self, tour: Tour, at: int, sites: Ints) -> Floats:
        ground = self._tours.ground
        before, *after = tour.cells[at : at + 2]
        extra = ground.distances(tour.kind, before)[sites]
        if after:
            extra = extra + ground.distances(tour.kind, after[0])[sites] - ground.apart(tour.kind, before, after)[0]
        return np.asarray(extra * ground.ms_per_cell(tour.kind))

    def _length(self, tour: Tour) -> float:
        return sum(float(self._tours.ground.apart(tour.kind, a, [b])[0]) for a, b in pairwise(tour.cells))
