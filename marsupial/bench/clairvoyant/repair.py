"""Puts stops for what is not seen yet where they cost the least, one after the other."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from marsupial.bench.clairvoyant.ground import Cells
from marsupial.bench.clairvoyant.outline import Outline
from marsupial.bench.clairvoyant.ways import Way, Ways
from marsupial.planning.greedy import serve

LATE = 4.0
"""What a ms beyond the time limit costs beside one of driving."""

FIXED_MS = 500.0
"""What a stop costs beside its driving: few that see much are better than many."""

NOISE = 0.3
"""How much costs are taken to vary: the standard deviation of their logarithm."""

SITES = 100
"""Of how many sites of a type that may see a cell one is chosen."""


class _Choice(NamedTuple):
    """A site by its number, what it costs for each missed cell that it sees, and after which place of which way."""

    cost: float
    kind: str
    site: int
    place: tuple[Way, int] | None


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
    done = {robot.name: 0 for robot in ways.ground.robots}
    for action in outline.plan.actions:
        done |= {robot: max(done[robot], action.end_ms) for robot in action.robots}
    unserved = False
    while missed:
        missed &= ~(seen := _add(ways, missed, rng, done, limit_ms))[0]
        unserved |= seen[1]
    outline = ways.outline()
    if unserved:
        plan, left = serve(outline.situation, outline.plan)
        outline = outline.with_plan(plan).without(left)
    return outline


def _add(
    ways: Ways, missed: Cells, rng: np.random.Generator, done: dict[str, int], limit_ms: int
) -> tuple[Cells, bool]:
    """Add a stop that sees one of the missed cells, drawn; return what it sees, and whether nobody goes there yet."""
    ground = ways.ground
    cell = ground.drawn(missed, rng)
    best: _Choice | None = None
    for kind in ground.kinds:
        near = ground.sites_near(kind, cell)
        near = near if len(near) <= SITES else rng.choice(near, SITES, replace=False)
        bit, views = ground.bit_of(cell), ground.site_views(kind)
        sites = np.array([n for n in near.tolist() if views[n] & bit], dtype=np.int64)
        if len(sites):
            found = _cheapest(ways, kind, sites, missed, rng, done, limit_ms)
            best = found if best is None or found.cost < best.cost else best
    if best is None:  # one of the few cells that a single site sees
        return ground.bit_of(cell), False
    seen = ground.site_views(best.kind)[best.site] & missed
    here = ground.cell(ground.sites[best.kind][best.site])
    if best.place is None:
        ways.put_down(best.kind, here, seen)
        return seen, True
    way, at = best.place
    before = _length(way, ways)
    ways.insert(way, at, here, seen)
    done[way.robot] += round((_length(way, ways) - before) * ground.ms_per_cell(way.kind))
    return seen, False


def _length(way: Way, ways: Ways) -> float:
    pairs = pairwise(way.cells)
    return sum(float(ways.ground.apart(way.kind, a, [b])[0]) for a, b in pairs)


def _cheapest(
    ways: Ways,
    kind: str,
    sites: npt.NDArray[np.int64],
    missed: Cells,
    rng: np.random.Generator,
    done: dict[str, int],
    limit_ms: int,
) -> _Choice:
    views = ways.ground.site_views(kind)
    gains = np.array([(views[n] & missed).bit_count() for n in sites.tolist()], dtype=np.float64)
    costs, places = _insertions(ways, kind, sites, done, limit_ms)
    costs = (costs + FIXED_MS) / gains * np.exp(NOISE * rng.standard_normal(len(sites)))
    n = int(np.argmin(costs))
    return _Choice(float(costs[n]), kind, int(sites[n]), places[n])


def _insertions(
    ways: Ways, kind: str, sites: npt.NDArray[np.int64], done: dict[str, int], limit_ms: int
) -> tuple[npt.NDArray[np.float64], list[tuple[Way, int] | None]]:
    """Return the least cost, in ms, of driving to each site, and after which place; None where nobody can."""
    ground = ways.ground
    ms_per_cell = ground.ms_per_cell(kind)
    costs, where = np.full(len(sites), 4.0 * limit_ms), np.full(len(sites), -1)
    places = [(way, at) for way in ways.all if way.kind == kind for at in range(len(way.names) - way.ends_aboard())]
    for i, (way, at) in enumerate(places):
        before, *after = way.cells[at : at + 2]
        extra = ground.distances(kind, before)[sites]
        if after:
            extra = extra + ground.distances(kind, after[0])[sites] - ground.apart(kind, before, after)[0]
        extra = extra * ms_per_cell
        cost = extra + LATE * np.maximum(0.0, done[way.robot] + extra - limit_ms)
        nearer = cost < costs
        costs[nearer], where[nearer] = cost[nearer], i
    return costs, [None if i < 0 else places[i] for i in where.tolist()]
