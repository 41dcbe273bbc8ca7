"""The unseen part of a map, in squares, each about as large as a room.

A square belongs to it as long as at least half of it is unknown. The map is taken to end where its grid does; what is
unknown for ever, such as the inside of rock, can't be told from what is not yet seen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from marsupial.maps.targets import Target
from marsupial.maps.territory import Territory
from marsupial.model.grid import UNKNOWN
from marsupial.model.robots import Role
from marsupial.model.unseen import Square, Unseen

SIDE_M = 8.0
"""Length of the side of a square."""

UNKNOWN_SHARE = 0.5
"""Which share of a square has to be unknown."""

FIRST_GUESS, FIRST_GUESS_M2 = 0.3, 25.0
"""The share of ground for rovers only that is expected before any is seen, and how much seen ground that weighs."""


def unseen(territory: Territory, targets: Sequence[Target]) -> Unseen:
    """Return what is unseen of a territory, with the positions of its targets."""
    resolution = territory.grid.resolution_m
    return Unseen(
        squares=_squares(territory),
        at_m={target.name: (target.cell.x * resolution, target.cell.y * resolution) for target in targets},
        rovers_only=_rovers_only(territory),
        speed_mps={kind.name: kind.speed_mps for kind in territory.kinds.values()},
    )


def _squares(territory: Territory) -> tuple[Square, ...]:
    grid = territory.grid
    side = max(1, round(SIDE_M / grid.resolution_m))
    rows, columns = -(-grid.height // side), -(-grid.width // side)
    unknown = np.zeros((rows * side, columns * side))
    unknown[: grid.height, : grid.width] = grid.cells == UNKNOWN
    tiles = unknown.reshape(rows, side, columns, side)
    per_row, per_column = tiles.sum(axis=3), tiles.sum(axis=1)
    count = per_row.sum(axis=1)
    with np.errstate(invalid="ignore"):
        y = np.einsum("rsc,s->rc", per_row, np.arange(side)) / count
        x = np.einsum("rcs,s->rc", per_column, np.arange(side)) / count
    metres = grid.resolution_m
    return tuple(
        Square(
            name=f"{column}_{row}",
            x_m=float(column * side + x[row, column]) * metres,
            y_m=float(row * side + y[row, column]) * metres,
            share=float(count[row, column]) / side**2,
            draw=(37 * column + 61 * row) % 100 / 100,
        )
        for row, column in np.argwhere(count >= UNKNOWN_SHARE * side**2).tolist()
    )


def _rovers_only(territory: Territory) -> float:
    rovers, carriers = (
        frozenset[int]().union(*(kind.terrains for kind in territory.of_role(role)))
        for role in (Role.ROVER, Role.CARRIER)
    )
    cells = np.bincount(territory.grid.cells.ravel(), minlength=256) * territory.grid.cell_area_m2
    only, all_ground = (float(cells[sorted(codes)].sum()) for codes in (rovers - carriers, rovers | carriers))
    return (only + FIRST_GUESS * FIRST_GUESS_M2) / (all_ground + FIRST_GUESS_M2)
