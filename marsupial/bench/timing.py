"""How the benches of marsupial's own speed take times: CPU time, the median of some repeats."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Generic, TypeVar

Result = TypeVar("Result")

LONG_S = 2.0
"""A job that has taken this much CPU time is not repeated any more."""

TICK_S = 1e-9
"""The least time that is told: ratios are of times above 0."""


@dataclass(frozen=True, slots=True)
class Timed(Generic[Result]):
    """What a job returned the last time, and its median CPU time in seconds."""

    result: Result
    cpu_s: float


def timed(job: Callable[[], Result], repeats: int, *, warm: bool = False) -> Timed[Result]:
    """Time a job that can be repeated; `warm`: once more before that, since the first time may compile."""
    if warm:
        job()
    seconds: list[float] = []
    while len(seconds) < repeats:
        before = time.process_time()
        result = job()
        seconds.append(time.process_time() - before)
        if sum(seconds) >= LONG_S:
            break
    return Timed(result, max(median(seconds), TICK_S))
