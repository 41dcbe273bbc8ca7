"""What is known of the part of a map that nobody has seen yet: the ways there, and what ground there is elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Metres = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Square:
    """A square of the map, much of which is unknown.

    Parameters
    ----------
    name
        The same for the same square throughout a mission.
    share
        Which share of the square is unknown, above 0 and up to 1.
    draw
        A number from 0 to 1 that stays the same, for whatever is true of only some squares.
    """

    name: str
    share: float
    draw: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unseen:
    """The squares that are left, and what helps to guess what is in them.

    Parameters
    ----------
    gates
        Names of the targets that carriers can explore.
    from_gates_m, between_m
        Length of the shortest ways from each gate to the middle of each square, float64 (gates, squares), and from
        square to square (squares, squares), in metres, over ground for carriers and all that is unknown; inf where
        there is none.
    rovers_only
        Share of the ground seen so far that only rovers can drive on, from 0 to 1.
    speed_mps
        Of each robot type.
    """

    squares: tuple[Square, ...] = ()
    gates: tuple[str, ...] = ()
    from_gates_m: Metres = field(default_factory=lambda: np.empty((0, 0)))
    between_m: Metres = field(default_factory=lambda: np.empty((0, 0)))
    rovers_only: float = 0.0
    speed_mps: Mapping[str, float] = field(default_factory=dict)
