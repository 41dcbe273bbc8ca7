"""Puts stops for what is not seen yet where they cost the least, one after the other."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.model.grid import Cell
from marsupial.model.plan import Plan
from marsupial.planning.list_scheduling.greedy import serve
from marsupial.strategies.clairvoyant.ground import Cells
from marsupial.strategies.clairvoyant.outline import Outline
from marsupial.strategies.clairvoyant.ways import Way, Ways

Indices = npt.NDArray[np.int64]

LATE = 4.0
"""What a ms beyond the time limit costs beside one of driving."""

FIXED_MS = 500.0
"""What a stop costs beside its driving: few that see much are better than many."""

NOISE = 0.3
"""How much costs are taken to vary: the standard deviation of their logarithm."""

NOBODY = 4.0
"""What a stop that nobody can go to costs, beside the time limit."""

SITES = 100
"""Of how many sites of a type that may see a cell one is chosen."""


Place = tuple[Way, int]
"""A way, and the number of the place on it after which a stop may come."""


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
    ways = Ways(outline)
    missed = ways.missed
    if not missed:
        return outline
    repair = _Repair(ways, outline.plan, rng, limit_ms)
    while missed:
        missed &= ~repair.add_stop(missed)
    outline = ways.outline()
    if repair.is_partial:
        plan, left = serve(outline.situation, outline.plan)
        outline = outline.with_plan(plan).without(left)
    return outline


class _Repair:
    """Adds stops to ways.

    Attributes
    ----------
    is_partial
        Whether there is a stop that nobody goes to yet.
    """

    def __init__(self, ways: Ways, plan: Plan, rng: np.random.Generator, limit_ms: int) -> None:
        self._ways, self._rng, self._limit_ms = ways, rng, limit_ms
        self._done_ms: Counter[str] = Counter()
        for action in plan.actions:
            for robot in action.robots:
                self._done_ms[robot] = max(self._done_ms[robot], action.end_ms)
        self.is_partial = False

    def add_stop(self, missed: Cells) -> Cells:
        """Add a stop that sees one of the missed cells, drawn; return which of them it sees."""
        ground, ways = self._ways.ground, self._ways
        cell = ground.drawn(missed, self._rng)
        choices = [
            self._cheapest(kind, sites, missed) for kind in ground.kinds if len(sites := self._sites(kind, cell))
        ]
        _, kind, site, place = min(choices, key=lambda choice: choice.cost)
        seen = ground.site_views(kind)[site] & missed
        here = ground.cell(ground.sites[kind][site])
        if place is None:
            ways.put_down(kind, here, seen)
            self.is_partial = True
        else:
            before = self._length(place[0])
            ways.insert(*place, here, seen)
            longer = self._length(place[0]) - before
            self._done_ms[place[0].robot] += round(longer * ground.ms_per_cell(kind))
        return seen

    def _sites(self, kind: str, cell: Cell) -> Indices:
        """Return the numbers of the sites of a type that see a cell, or of some of them."""
        ground = self._ways.ground
        near, bit, views = ground.sites_near(kind, cell), ground.bit_of(cell), ground.site_views(kind)
        some = near if len(near) <= SITES else self._rng.choice(near, SITES, replace=False)
        seeing = [n for n in some.tolist() if views[n] & bit] or [n for n in near.tolist() if views[n] & bit]
        return np.array(seeing, dtype=np.int64)

    def _cheapest(self, kind: str, sites: Indices, missed: Cells) -> _Choice:
        views = self._ways.ground.site_views(kind)
        gains = np.array([(views[n] & missed).bit_count() for n in sites.tolist()], dtype=np.float64)
        costs, places = self._insertions(kind, sites)
        costs = (costs + FIXED_MS) / gains * np.exp(NOISE * self._rng.standard_normal(len(sites)))
        n = int(np.argmin(costs))
        return _Choice(float(costs[n]), kind, int(sites[n]), places[n])

    def _insertions(self, kind: str, sites: Indices) -> tuple[npt.NDArray[np.float64], list[Place | None]]:
        """Return the least cost, in ms, of driving to each site, and where it comes in; None where nobody can."""
        ways = [way for way in self._ways.all if way.kind == kind]
        places = [(way, at) for way in ways for at in range(len(way.names) - way.ends_aboard())]
        costs, where = np.full(len(sites), NOBODY * self._limit_ms), np.full(len(sites), -1)
        for i, (way, at) in enumerate(places):
            extra = self._detours(way, at, sites)
            late = self._done_ms[way.robot] + extra - self._limit_ms
            cost = extra + LATE * np.maximum(0.0, late)
            nearer = cost < costs
            costs[nearer], where[nearer] = cost[nearer], i
        return costs, [None if i < 0 else places[i] for i in where.tolist()]

    def _detours(self, way: Way, at: int, sites: Indices) -> npt.NDArray[np.float64]:
        """Return how long it takes, in ms, to go to each site after a place of a way."""
        ground = self._ways.ground
        before, *after = way.cells[at : at + 2]
        extra = ground.distances(way.kind, before)[sites]
        if after:
            extra = extra + ground.distances(way.kind, after[0])[sites] - ground.apart(way.kind, before, after)[0]
        return np.asarray(extra * ground.ms_per_cell(way.kind))

    def _length(self, way: Way) -> float:
        return sum(float(self._ways.ground.apart(way.kind, a, [b])[0]) for a, b in pairwise(way.cells))
