"""Means over missions with 95 % intervals, for missions that have maps and starts in common.

Missions from one start turn out alike with every team, and so do missions on one map. An interval that counts each of
them as independent is too narrow. So missions from one start are averaged to one value, and so are the starts of a map:

    maps    with `FEWEST_UNITS` maps or more, these are the independent units: Student's t over their means. The
            interval says what to expect on other maps of the kind. Floors of one building are alike, so they are
            averaged to one value as well, and the units are buildings.
    starts  with fewer, starts are: Student's t over their means within each map. The interval holds for these maps
            alone.

Each building has the same weight in the mean, each map the same in its building, and each start the same in its map.
A bootstrap over maps and starts needs no normal distribution, but with five maps its 95 % intervals cover 90 %.

References
----------
Bland, Kerry: Trials randomised in clusters (BMJ 1997, 315:600): the analysis of cluster means.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple, TypeVar

import numpy as np

from marsupial.arrays import Floats
from marsupial.bench.suite.maps import building_of

Key = TypeVar("Key", bound=Hashable)

LEVEL = 0.95

# Least number of independent units for an interval: fewer hardly show how much they differ.
FEWEST_UNITS = 5


class Origin(NamedTuple):
    """Where a mission begins: its map, and the seed that draws its starts."""

    map: str
    seed: int


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean of `count` values, and the ends of its interval, None if it rests on too few `units` (maps or such)."""

    count: int
    units: str
    mean: float
    low: float | None = None
    high: float | None = None

    @property
    def half(self) -> float | None:
        return None if self.low is None or self.high is None else (self.high - self.low) / 2

    @property
    def sides(self) -> tuple[float, float]:
        """Length of the interval below and above the mean, for an error bar; 0 without one."""
        return (0.0, 0.0) if self.low is None or self.high is None else (self.mean - self.low, self.high - self.mean)

    @property
    def sign(self) -> int:
        """1 or -1 if the whole interval is above or below 0, else 0."""
        return (self.low is not None and self.low > 0) - (self.high is not None and self.high < 0)

    def mapped(self, by: Callable[[float], float]) -> Estimate:
        """Return the estimate of an increasing function of what is estimated."""
        low, high = (None if end is None else by(end) for end in (self.low, self.high))
        return replace(self, mean=by(self.mean), low=low, high=high)


def estimate(origins: Sequence[Origin], values: Sequence[float]) -> Estimate | None:
    """Return the mean of `values`, by the origins of their missions, with its interval; None without any."""
    if not origins:
        return None
    mean, half, units = clustered(origins, np.array(values, dtype=np.float64))
    centre = float(mean)
    ends = () if half is None else (centre - float(half), centre + float(half))
    return Estimate(len(values), units, centre, *ends)


def clustered(origins: Sequence[Origin], values: Floats) -> tuple[Floats, Floats | None, str]:
    """Return means of `values` (missions, ...), half of their intervals if there are any, and the units in words."""
    starts, by_start = _means(origins, values)
    maps, by_map = _means([start.map for start in starts], by_start)
    building = [building_of(name) for name in maps]  # of each map
    buildings, by_building = _means(building, by_map)
    if len(buildings) >= FEWEST_UNITS:
        units = f"{len(buildings)} {'maps' if len(buildings) == len(maps) else 'buildings'}"
        freedom = len(buildings) - 1
        apart = by_building - by_building.mean(axis=0)
        share = 1 / len(buildings)
    else:
        units, freedom = f"{len(starts)} start{'s' * (len(starts) != 1)}", len(starts) - len(maps)
        apart = by_start - by_map[[maps.index(start.map) for start in starts]]
        weights = [1 / building.count(its) for its in building]
        counts = [sum(start.map == name for start in starts) for name in maps]
        share = sum(w**2 / n for w, n in zip(weights, counts, strict=True)) / len(buildings) ** 2
    half = None
    if freedom + 1 >= FEWEST_UNITS:
        half = t_quantile(freedom) * np.sqrt((apart**2).sum(axis=0) / freedom * share)
    return by_building.mean(axis=0), half, units


def _means(keys: Sequence[Key], values: Floats) -> tuple[list[Key], Floats]:
    """Return the distinct keys, and the mean of the values of each."""
    place = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    at = [place[key] for key in keys]
    sums = np.zeros((len(place), *values.shape[1:]))
    np.add.at(sums, at, values)
    return list(place), sums / np.bincount(at).reshape(-1, *[1] * (values.ndim - 1))


@cache
def t_quantile(freedom: int) -> float:
    """Return half the width of the interval in standard errors, for a number of degrees of freedom."""
    from scipy.special import stdtrit  # the quantile function of scipy.stats.t, without the second it takes to import

    return float(stdtrit(freedom, (1 + LEVEL) / 2))
