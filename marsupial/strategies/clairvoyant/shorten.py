"""Shortens tours without seeing less: drops stops that see nothing of their own, and moves the others."""

from __future__ import annotations

import numpy as np

from marsupial.model import ActionName, Cell
from marsupial.strategies.clairvoyant.ground import Cells
from marsupial.strategies.clairvoyant.outline import Outline, Tour
from marsupial.strategies.clairvoyant.tours import Tours

TRIES = 8
"""Most candidate places that are checked exactly, for each stop."""

LESS_CELLS = 0.1
"""Least gain in tour length that justifies a change."""


def shortened(outline: Outline, passes: int = 2) -> Outline:
    """Return the outline with stops dropped and moved; it sees the same cells."""
    ends = {a.place: a.end_ms for a in outline.plan.actions if a.name is ActionName.EXPLORE}
    # late stops first: what other stops see as well need not be seen late
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
    # drop it if others see its cells, or if driving past would do and it is not a rover's only stop
    if not own or not (tours.is_only_stop(tour, at) or own & ~passing):
        tours.drop(tour, at)
        return False
    cell = _better(tours, tour, at, own, passing)
    if cell is not None:
        tours.move(tour, at, cell, own)
    return True


def _ends(tour: Tour, at: int) -> tuple[Cell, ...]:
    return (tour.cells[at - 1], *tour.cells[at + 1 : at + 2])


def _better(tours: Tours, tour: Tour, at: int, own: Cells, passing: Cells) -> Cell | None:
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
