"""What is known of the unseen part of a map: where it lies, and what the ground is like elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class Square:
    """A square of the map, much of which is unknown.

    Parameters
    ----------
    name
        The same for the same square throughout a mission.
    x_m, y_m
        The middle of what is unknown in it, from the corner of the map.
    share
        Which share of the square is unknown, above 0 and up to 1.
    draw
        A number from 0 to 1 that stays the same, for whatever is true of only some squares.
    """

    name: str
    x_m: float
    y_m: float
    share: float
    draw: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """The squares that are left, and what helps to guess what is in them.

    Parameters
    ----------
    at_m
        Position of each target, in metres from the corner of the map.
    rovers_only
        Share of the ground seen so far that only rovers can drive on, from 0 to 1.
    speed_mps
        Of each robot type.
    """

    squares: tuple[Square, ...] = ()
    at_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rovers_only: float = 0.0
    speed_mps: Mapping[str, float] = field(default_factory=dict)
