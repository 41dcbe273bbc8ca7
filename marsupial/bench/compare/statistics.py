"""Means with 95 % confidence intervals (Student's t), of values and of paired differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import sqrt
from statistics import fmean, stdev

LEVEL = 0.95

FEWEST_PAIRS = 5
"""Least number of pairs for an interval: fewer hardly show the spread, and Student's t is then too narrow."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean of `count` values and half the width of its interval, None if there are too few values."""

    count: int
    mean: float
    half: float | None

    @property
    def low(self) -> float | None:
        """Lower end of the interval."""
        return None if self.half is None else self.mean - self.half

    @property
    def high(self) -> float | None:
        """Upper end of the interval."""
        return None if self.half is None else self.mean + self.half

    @property
    def sign(self) -> int:
        """1 or -1 if the whole interval is above or below 0, else 0."""
        if self.half is None or abs(self.mean) <= self.half:
            return 0
        return 1 if self.mean > 0 else -1


def estimate(values: Sequence[float], fewest: int = 2) -> Estimate | None:
    """Return the mean of `values`, with its interval if there are at least `fewest`; None without any."""
    if not values:
        return None
    count = len(values)
    half = None if count < fewest else t_quantile(count - 1) * stdev(values) / sqrt(count)
    return Estimate(count, fmean(values), half)


@cache
def t_quantile(freedom: int) -> float:
    """Return half the width of the interval in standard errors, for a number of degrees of freedom."""
    from scipy.special import stdtrit  # the quantile function of scipy.stats.t, without the second it takes to import

    return float(stdtrit(freedom, (1 + LEVEL) / 2))
