"""What is told of a mission's map; in a process of its own where that is much."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from marsupial.model.grid import CellArray, Grid
from marsupial_service.jobs.documents import line
from marsupial_service.missions.values import runs_in
from marsupial_service.schemas.answers import KnownMapAnswer


def changes_in(cells: CellArray) -> int:
    """Return how often a cell differs from the one before it: about as many runs there are."""
    return int(np.count_nonzero(np.diff(cells.ravel())))


def known_map_text(known: Grid) -> bytes:
    """Return a map as JSON."""
    return line(KnownMapAnswer.of(known, runs=runs_in(known.cells)).model_dump()).encode()


def tell_known_map(known: Grid) -> Iterator[bytes]:
    """Yield a map as JSON; the function of a job."""
    yield known_map_text(known)
