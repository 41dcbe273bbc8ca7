"""The operator's settings: where the service listens, where it stores its data, and every limit.

Each field of `ServiceLimits` can be given as an environment variable: ``MARSUPIAL_`` and its name in capitals
(``MARSUPIAL_BODY_BYTES=1000000``). ``/v1/limits`` shows the limits in force.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from marsupial.errors import UsageError
from marsupial.model.bounds import MOST_ROBOTS
from marsupial.model.sizes import SIZES

PREFIX = "MARSUPIAL_"
# no key can use so many seconds of planning in an hour
UNBOUNDED_S = 1e9

LOOPBACK = ("127.0.0.1", "::1", "localhost")

N = TypeVar("N", int, float)


def _limit(default: N, at_least: N, meaning: str, at_most: float = math.inf) -> N:
    number: N = field(default=default, metadata={"at_least": at_least, "at_most": at_most, "meaning": meaning})
    return number


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceLimits:
    """The limits of one request, one key and the whole service. Raises UsageError if a limit is too small."""

    body_bytes: int = _limit(16_000_000, 1000, "bytes of a request body")
    body_s: float = _limit(10.0, 0.1, "seconds for a request body to arrive, in addition to those for its bytes")
    body_rate: int = _limit(50_000, 1, "least bytes per second of an arriving body")
    bodies_bytes: int = _limit(128_000_000, 1000, "bytes of all request bodies that are being received and read")
    readers: int = _limit(2, 1, "processes that read large bodies")
    read_s: float = _limit(30.0, 0.1, "seconds to read a large body")
    read_memory_bytes: int = _limit(1 << 30, 1 << 26, "bytes of memory to read a large body")
    answer_bytes: int = _limit(32_000_000, 1000, "bytes of an analysis")
    connections: int = _limit(1000, 1, "open connections, beyond which requests are answered 503")
    cells: int = _limit(6_000_000, 1, "cells of a map")
    robots: int = _limit(200, 1, "robots of a team", MOST_ROBOTS)
    targets: int = _limit(1000, 1, "targets of a situation")
    places: int = _limit(2000, 1, "places of a situation")
    actions: int = _limit(100_000, 1, "actions of a plan, and commands of a report")
    plan_bytes: int = _limit(10_000_000, 1, "characters of a plan as text")
    runs: int = _limit(3_000_000, 3, "numbers of cells given as runs")
    radius_cells: float = _limit(SIZES["radius_cells"].most, 1, SIZES["radius_cells"].meaning)
    footprint_cells: float = _limit(2e11, 1, SIZES["footprint_cells"].meaning)
    layers: float = _limit(2e8, 1, SIZES["layers"].meaning)
    budget_s: float = _limit(300.0, 0.01, "seconds of a planning budget")
    budget_steps: int = _limit(10_000_000, 1, "steps of a planning budget")
    steps_s: float = _limit(300.0, 0.01, "seconds after which planning with a budget in steps is stopped")
    memory_bytes: int = _limit(2 << 30, 1 << 26, "bytes of memory for all processes of a job")
    slots: int = _limit(max(1, os.cpu_count() or 1), 1, "concurrent plannings of jobs and missions")
    queue: int = _limit(1000, 0, "waiting jobs")
    key_queue: int = _limit(500, 0, "waiting jobs per key")
    streams: int = _limit(64, 1, "open event streams per key")
    wait_s: float = _limit(
        30.0, 0.0, "seconds that a request waits for its job (Prefer: wait), or an analysis for a slot"
    )
    analyses: int = _limit(2, 1, "concurrent analyses, and waiting analyses per key")
    analysis_s: float = _limit(30.0, 0.1, "seconds of an analysis")
    retention_s: float = _limit(7 * 86400.0, 1.0, "seconds a job or mission is kept after its end")
    kept_jobs: int = _limit(10_000, 1, "jobs kept after their end")
    missions: int = _limit(20, 1, "open missions")
    key_missions: int = _limit(20, 1, "open missions per key")
    simulations: int = _limit(6, 1, "open simulated missions, besides the first of a key")
    idle_s: float = _limit(86400.0, 1.0, "seconds without a report after which a mission is cancelled")
    backlog: int = _limit(1000, 1, "waiting reports of a mission")
    kept_missions: int = _limit(1000, 1, "missions kept after their end")
    key_planning_s: float = _limit(UNBOUNDED_S, 1.0, "seconds of planning per key and hour")
    store_bytes: int = _limit(10_000_000_000, 1, "bytes of jobs and missions beyond which no more are accepted")
    key_bytes: int = _limit(5_000_000_000, 1, "bytes of jobs and missions per key beyond which no more are accepted")

    def __post_init__(self) -> None:
        for one in fields(self):
            fault = _fault(one, getattr(self, one.name))
            if fault is not None:
                raise UsageError(f"{one.name}: {fault}")

    @property
    def sizes(self) -> Mapping[str, float]:
        """The limits on sizes that follow from several numbers (`marsupial.model.sizes`)."""
        return {name: getattr(self, name) for name in SIZES}


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceSettings:
    """Where the service listens (port 0: any free port), and stores its data.

    Jobs, missions and keys are kept in the folder `data`, or in the PostgreSQL database at the address `store`, which
    other servers may use too. `keys` makes every request need an API key; a service that listens to other machines
    always needs them. `planners` are command lines of external planners (``cmd:optic {domain} {problem}``) by the names
    that clients use.
    """

    data: Path
    store: str | None = None
    host: str = "127.0.0.1"
    port: int = 8080
    keys: bool = False
    limits: ServiceLimits = field(default_factory=ServiceLimits)
    planners: Mapping[str, str] = field(default_factory=dict)

    @property
    def place(self) -> str | Path:
        """The folder or database of jobs, missions and keys."""
        return self.data if self.store is None else self.store

    def effective(self) -> ServiceSettings:
        """Return the settings with the limits in force: limits per key apply only if keys are required.

        If keys have a planning quota, no budget may exceed it.
        """
        limits = self.limits
        if self.needs_keys:
            most_s = limits.key_planning_s
            held = replace(limits, budget_s=min(limits.budget_s, most_s), steps_s=min(limits.steps_s, most_s))
        else:
            held = replace(
                limits,
                key_queue=limits.queue,
                key_missions=limits.missions,
                key_bytes=limits.store_bytes,
                key_planning_s=UNBOUNDED_S,
            )
        return replace(self, limits=held)

    @property
    def needs_keys(self) -> bool:
        return self.keys or self.host not in LOOPBACK


def limits_from(environment: Mapping[str, str], options: Mapping[str, str] | None = None) -> ServiceLimits:
    """Return the limits set by options (``--limit``, by name) and environment variables. Raises UsageError."""
    given: dict[str, float] = {}
    for one in fields(ServiceLimits):
        said, text = f"--limit {one.name}", (options or {}).get(one.name)
        if text is None:
            said, text = PREFIX + one.name.upper(), environment.get(PREFIX + one.name.upper())
        if text is None:
            continue
        try:
            given[one.name] = int(text) if one.type == "int" else float(text)
        except ValueError:
            raise UsageError(f"{said}: must be a number, got {text!r}") from None
        fault = _fault(one, given[one.name])
        if fault is not None:
            raise UsageError(f"{said}: {fault}")
    return ServiceLimits(**given)  # type: ignore[arg-type]


def _fault(one: Field[Any], value: float) -> str | None:
    """Return what is wrong with the value of a limit, or None."""
    if value > one.metadata["at_most"]:
        return f"must be at most {one.metadata['at_most']}, got {value}"
    if one.metadata["at_least"] <= value < math.inf:
        return None
    return f"must be {one.metadata['at_least']} or more, got {value}"
