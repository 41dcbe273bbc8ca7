"""A description of the unknown part of a map, from which strategies guess what is there.

`marsupial.maps.unseen` divides the unknown into squares. The ground seen so far tells how much of it may be for rovers
only (`marsupial.strategies.guess`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class Square:
    """A square of the map that is largely unknown."""

    name: str  # stays the same during a mission
    # x_m, y_m: centre of its unknown cells, from the corner of the map
    x_m: float
    y_m: float
    share: float  # unknown share of the square, above 0 and up to 1
    draw: float  # a random number from 0 to 1 that stays the same during a mission, to choose some of the squares


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """The unknown squares, and figures to guess what is in them."""

    squares: tuple[Square, ...] = ()
    # position of each target, in metres from the corner of the map
    at_m: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rovers_only: float = 0.0  # share of the ground seen so far that only rovers can drive on, from 0 to 1
    speed_mps: Mapping[str, float] = field(default_factory=dict)  # by robot type
