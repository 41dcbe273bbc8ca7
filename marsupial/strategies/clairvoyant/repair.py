"""Puts stops for what is not seen yet where they cost the least, one after the other."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from marsupial.arrays import Floats, Ints
from marsupial.model.grid import Cell
from marsupial.model.plan import Plan
from marsupial.planning.list_scheduling.greedy import serve
from marsupial.strategies.clairvoyant.ground import Cells
from marsupial.strategies.clairvoyant.outline import Outline, Tour
from marsupial.strategies.clairvoyant.tours import Tours

LATE = 4.0
"""What a ms beyond the time limit costs beside one of driving."""

FIXED_MS = 500.0
"""What a stop costs beside its driving: few that see much are better than many."""

NOISE = 0.3
"""How much costs are taken to vary: the standard deviation of their logarithm."""

UNSERVED = 4.0
"""What a stop that no robot can go to costs, beside the time limit."""

SITES = 100
"""Of how many sites of a type that may see a cell one is chosen."""


Place = tuple[Tour, int]
"""A tour, and the number of the place on it after which a stop may come."""


class _Choice(NamedTuple):
    """A site by its number, what it costs for each missed cell that it sees, and where it comes in, if anywhere."""

    cost: float
    kind: str
    site: int
    place: Place | None


def repaired(outline: Outline, rng: np.random.Generator, limit_ms: int) -> Outline:
    """Return the outline with more stops, so that everything is seen, as far as that is possible.

    Parameters
    ----------
    limit_ms
        Robots that are done before it are preferred.
    """
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
    """Adds stops to tours.

    Attributes
    ----------
    is_partial
        Whether there is a stop that no robot goes to yet.
    """

    def __init__(self, tours: Tours, plan: Plan, rng: np.random.Generator, limit_ms: int) -> None:
        self._tours, self._rng, self._limit_ms = tours, rng, limit_ms
        self._done_ms: Counter[str] = Counter()
        for action in plan.actions:
            for robot in action.robots:
                self._done_ms[robot] = max(self._done_ms[robot], action.end_ms)
        self.is_partial = False

    def add_stop(self, missed: Cells) -> Cells:
        """Add a stop that sees one of the missed cells, drawn; return which of them it sees."""
        ground, tours = self._tours.ground, self._tours
        cell = ground.drawn(missed, self._rng)
        choices = [
            self._cheapest(kind, sites, missed) for kind in ground.kinds if len(sites := self._sites(kind, cell))
        ]
        _, kind, site, place = min(choices, key=lambda choice: choice.cost)
        seen = ground.site_views(kind)[site] & missed
        here = ground.cell(ground.sites[kind][site])
        if place is None:
            tours.put_down(kind, here, seen)
            self.is_partial = True
        else:
            before = self._length(place[0])
            tours.insert(*place, here, seen)
            longer = self._length(place[0]) - before
            self._done_ms[place[0].robot] += round(longer * ground.ms_per_cell(kind))
        return seen

    def _sites(self, kind: str, cell: Cell) -> Ints:
        """Return the numbers of the sites of a type that see a cell, or of some of them."""
        ground = self._tours.ground
        near, bit, views = ground.sites_near(kind, cell), ground.bit_of(cell), ground.site_views(kind)
        some = near if len(near) <= SITES else self._rng.choice(near, SITES, replace=False)
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
        """Return the least cost, in ms, of driving to each site, and where it comes in; None where no robot can."""
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
        """Return how long it takes, in ms, to go to each site after a place of a tour."""
        ground = self._tours.ground
        before, *after = tour.cells[at : at + 2]
        extra = ground.distances(tour.kind, before)[sites]
        if after:
            extra = extra + ground.distances(tour.kind, after[0])[sites] - ground.apart(tour.kind, before, after)[0]
        return np.asarray(extra * ground.ms_per_cell(tour.kind))

    def _length(self, tour: Tour) -> float:
        return sum(float(self._tours.ground.apart(tour.kind, a, [b])[0]) for a, b in pairwise(tour.cells))
