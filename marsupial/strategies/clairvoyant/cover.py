"""Finds stops from which a team sees everything: a randomised greedy set cover.

References
----------
D. S. Johnson, Approximation algorithms for combinatorial problems, Journal of Computer and System Sciences 9, 1974.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping

import numpy as np

from marsupial.model.grid import Cell
from marsupial.strategies.clairvoyant.ground import Cells, Ground
from marsupial.strategies.clairvoyant.outline import Stop

NEAR = 60
"""Number of nearby sites searched for one from which another robot type sees the same cells."""


def cover(ground: Ground, worth: Mapping[str, float], noise: float, rng: np.random.Generator) -> Iterator[Stop]:
    """Yield stops from which all wanted cells are seen.

    A site's value is the `worth` of its type for each cell seen, increased at random by a share of up to `noise`.
    """
    sites = [(kind, int(index)) for kind in ground.kinds for index in ground.sites[kind]]
    views = [view for kind in ground.kinds for view in ground.site_views(kind)]
    factors = [
        worth[kind] * (1 + noise * share) for (kind, _), share in zip(sites, rng.random(len(sites)), strict=True)
    ]
    heap = [(-factors[i] * view.bit_count(), i) for i, view in enumerate(views) if view]
    heapq.heapify(heap)
    left, count = ground.wanted, 0
    while left and heap:
        _, i = heapq.heappop(heap)
        gain = -factors[i] * (views[i] & left).bit_count()
        # gains only shrink as cells are covered: a stale entry is pushed back with its present gain
        if heap and gain > heap[0][0]:
            if gain:
                heapq.heappush(heap, (gain, i))
            continue
        kind, index = sites[i]
        yield stop_at(ground, f"c_{count}", kind, ground.cell(index), views[i] & left)
        left &= ~views[i]
        count += 1


def stop_at(ground: Ground, name: str, kind: str, cell: Cell, cells: Cells) -> Stop:
    """Return a stop at a site of one type; other types stop at their nearest site that sees the same cells."""
    viewpoints = {kind: cell}
    for other in ground.kinds:
        if other != kind:
            found = _nearest_seeing(ground, other, cell, cells)
            if found is not None:
                viewpoints[other] = found
    return Stop(name=name, viewpoints=viewpoints)


def _nearest_seeing(ground: Ground, kind: str, cell: Cell, cells: Cells) -> Cell | None:
    sites, views = ground.sites[kind], ground.site_views(kind)
    apart = np.hypot(sites % ground.width - cell.x, sites // ground.width - cell.y)
    near = np.argsort(apart, kind="stable")[:NEAR].tolist()
    return next((ground.cell(sites[n]) for n in near if cells & views[n] == cells), None)
