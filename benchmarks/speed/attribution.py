"""Attribute the time of a job to parts of marsupial, by Python's profiler.

Modules belong to parts. A function's own time counts for its module's part. If the module has no part, like libraries
and code that several parts use, the time is divided among the function's callers, by the time spent in their calls.
Profiling costs time for each call. That is subtracted: it is the difference to the job's time without the profiler.
"""

from __future__ import annotations

import cProfile
import pstats
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

import marsupial

Result = TypeVar("Result")

REST = "other"
"""The part of calls that come from no part."""

CALLERS = ""
"""The part of modules whose time counts for their callers, although their package belongs to a part."""

_ROOT = Path(marsupial.__file__).resolve().parent.parent

Function = tuple[str, int, str]
"""The profiler's key of a function: file, line, name."""

Callers = Mapping[Function, tuple[int, int, float, float]]
"""By caller, in seconds: calls that were not recursive, calls, own time, time with all that was called."""

Shares = Mapping[str, float]
"""By part; they sum to 1."""


def profiled(job: Callable[[], Result], parts: Mapping[str, str], plain_s: float) -> tuple[Result, dict[str, float]]:
    """Return a job's result, and the CPU seconds of each part, which sum to `plain_s`.

    Parameters
    ----------
    parts
        The part of each module or package, by its name after ``marsupial.``; the longest name that fits counts.
    plain_s
        CPU seconds that the job takes without the profiler.
    """
    profile = cProfile.Profile(time.process_time, builtins=False)
    result = profile.runcall(job)
    stats = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    shares = Profile(stats, parts).shares(plain_s)
    return result, {part: share * plain_s for part, share in shares.items()}


class Profile:
    """Where the time of a job went.

    Parameters
    ----------
    stats
        By function: calls that were not recursive, calls, own time, time with all that was called, callers.
    parts
        As for `profiled`.
    """

    def __init__(
        self, stats: Mapping[Function, tuple[int, int, float, float, Callers]], parts: Mapping[str, str]
    ) -> None:
        self._stats = stats
        self._parts = parts
        self._known: dict[Function, Shares] = {}

    def shares(self, plain_s: float) -> Shares:
        """Return the share of each part in a job that takes `plain_s` without the profiler."""
        whole_s = sum(each[2] for each in self._stats.values())
        overhead_s = max(0.0, whole_s - plain_s) / max(1, sum(each[1] for each in self._stats.values()))
        sums = {part: 0.0 for part in (*self._parts.values(), REST) if part != CALLERS}
        for function, (_, times, profiled_s, _, callers) in self._stats.items():
            own_s = max(0.0, profiled_s - times * overhead_s)
            part = self._part(function)
            own = {part: 1.0} if part is not None else self._among(callers, frozenset({function}), own=True)
            for name, share in (own or {REST: 1.0}).items():
                sums[name] += share * own_s
        whole = sum(sums.values()) or 1.0
        return {name: seconds / whole for name, seconds in sums.items()}

    def _among(self, callers: Callers, asked: frozenset[Function], *, own: bool = False) -> Shares:
        """Return the shares of a function without a part, by its callers; empty if these belong to no part.

        Functions already `asked` on the way are left out, as they only close a cycle.
        """
        found = [
            (each[2 if own else 3], self._of(caller, asked)) for caller, each in callers.items() if caller not in asked
        ]
        whole = sum(weight for weight, shares in found if shares)
        sums: dict[str, float] = defaultdict(float)
        for weight, shares in found:
            for name, share in shares.items():
                sums[name] += share * weight / whole if whole else 0.0
        return sums

    def _of(self, function: Function, asked: frozenset[Function]) -> Shares:
        """Return the parts that a function works for."""
        part = self._part(function)
        if part is not None:
            return {part: 1.0}
        if not self._known.get(function):
            callers = self._stats[function][4] if function in self._stats else {}
            self._known[function] = self._among(callers, asked | {function})
        return self._known[function]

    def _part(self, function: Function) -> str | None:
        """Return the part that a function belongs to, or None."""
        path = Path(function[0])
        if not path.is_relative_to(_ROOT):
            return None
        module = list(path.relative_to(_ROOT).with_suffix("").parts[1:])
        while module:
            found = self._parts.get(".".join(module))
            if found is not None:
                return found or None
            module.pop()
        return None
