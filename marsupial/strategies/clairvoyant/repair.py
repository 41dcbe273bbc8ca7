"""Repairs an outline that misses cells: inserts stops one by one where they cost least.

A missed cell is drawn at random. The sites that see it are compared by the cost of the detour per missed cell seen,
with some noise, and the cheapest is inserted into a tour.
"""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.model import Cell, Plan
from marsupial.planning.list_scheduling.greedy import serve
from marsupial.strategies.clairvoyant.ground import Cells
from marsupial.strategies.clairvoyant.outline import Outline, Tour
from marsupial.strategies.clairvoyant.tours import Tours

LATE = 4.0  # cost of a ms beyond the time limit, relative to a ms of driving
FIXED_MS = 500.0  # cost of a stop in addition to driving: few stops that see much are better than many
NOISE = 0.3  # random variation of costs: the standard deviation of their logarithm
UNSERVED = 4.0  # cost of a stop that no robot can reach, relative to the time limit
SITES = 100  # most sites of a type compared for one cell
Place = tuple[Tour, int]  # a tour, and the number of its place after which a stop is inserted


class _Choice(NamedTuple):
    """A site by its number, its cost per missed cell that it sees, and where it is inserted, if anywhere."""

    cost: float
    kind: str
    site: int
    place: Place | None


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

    def add_stop(self, missed: Cells) -> Cells:
        """Add a stop that sees a random missed cell; return the missed cells that it sees."""
        ground, tours = self._tours.ground, self._tours
        cell = ground.drawn(missed, self._rng)
        choices = [
            self._cheapest(kind, sites, missed) for kind in ground.kinds if len(sites := self._sites(kind, cell))
        ]
        _, kind, site, place = min(choices, key=lambda choice: choice.cost)
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
        # a sample may by chance hold no site that sees the cell
        seeing = [n for n in some.tolist() if views[n] & bit] or [n for n in near.tolist() if views[n] & bit]
        return np.array(seeing, dtype=np.int64)

    def _cheapest(self, kind: str, sites: Ints, missed: Cells) -> _Choice:
        views = self._tours.ground.site_views(kind)
        gains = np.array([(views[n] & missed).bit_count() for n in sites.tolist()], dtype=np.float64)
        costs, places = self._insertions(kind, sites)
        costs = (costs + FIXED_MS) / gains * np.exp(NOISE * self._rng.standard_normal(len(sites)))
        n = int(np.argmin(costs))
        return _Choice(float(costs[n]), kind, int(sites[n]), places[n])

    def _insertions(self, kind: str, sites: Ints) -> tuple[Floats, list[Place | None]]:
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
