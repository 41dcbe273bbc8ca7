"""All parts of the trial, in order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from benchmarks.trial import (
    attack,
    fair,
    faulty_fleet,
    fuzz,
    hostile,
    kills,
    loads,
    pages,
    shared_kills,
    shrinking,
    speed,
)
from benchmarks.trial.rows import TrialRow


class Stores(StrEnum):
    """The databases of the servers to kill."""

    SQLITE = "sqlite"
    POSTGRESQL = "postgresql"
    BOTH = "both"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialExtent:
    """The extent of each part; 0 leaves a part out.

    Parameters
    ----------
    posts, plans
        Number of times to measure the time to the answer and to the first plan.
    half_open
        Connections without a request; the part also sends small requests for much work.
    load_seconds
        Duration of each load of reports and missions.
    fair_jobs
        Jobs of one key during another key's flood.
    stored
        Reports, nearly all of which are removed again.
    pages
        Plans of jobs, and as many of missions, to time until a page shows them.
    proxied
        Missions of a fleet with faults behind an unreliable proxy.
    """

    kills: int = 1000
    hostile: int = 200
    clients: int = 50
    posts: int = 500
    plans: int = 100
    half_open: int = 1000
    load_seconds: float = 60.0
    fair_jobs: int = 20
    stored: int = 100_000
    pages: int = 50
    proxied: int = 3
    fuzz_minutes: float = 15.0
    seed: int = 1


FULL = TrialExtent()
QUICK = TrialExtent(
    kills=10,
    hostile=12,
    clients=10,
    posts=50,
    plans=8,
    half_open=200,
    load_seconds=10.0,
    fair_jobs=2,
    stored=5000,
    pages=10,
    proxied=1,
    fuzz_minutes=0.0,
)
"""A short run of everything except fuzzing: five minutes on an idle machine."""


def trial(extent: TrialExtent, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Run every part and yield its rows; timed parts come first."""
    if extent.posts:
        yield from speed.answer_rows(extent.posts, say)
    if extent.plans:
        yield from speed.first_plan_rows(extent.plans, say)
    if extent.clients:
        yield from speed.concurrent_rows(extent.clients, say)
        yield from speed.end_rows(extent.clients, say)
        yield from speed.flood_rows(say)
    if extent.load_seconds:
        yield from loads.report_rows(extent.load_seconds, say)
        yield from loads.mission_rows(extent.load_seconds, say)
        yield from loads.missions_rows(extent.load_seconds, say)
    if extent.fair_jobs:
        yield from fair.rows(extent.fair_jobs, say)
    if extent.pages:
        yield from pages.rows(extent.pages, say)
    if extent.stored:
        yield from shrinking.rows(extent.stored, say)
    if extent.half_open:
        yield from attack.half_open_rows(extent.half_open, say)
        yield from attack.small_rows(say)
    if extent.proxied:
        yield from faulty_fleet.rows(extent.proxied, extent.seed, say)
    if extent.hostile:
        yield from hostile.rows(extent.hostile, say)
    if extent.kills:
        yield from kill_rows(extent.kills, extent.seed, Stores.SQLITE, say)
    if extent.fuzz_minutes:
        yield from fuzz.rows(extent.fuzz_minutes, extent.seed, say)


def kill_rows(count: int, seed: int, stores: Stores, say: Callable[[str], None]) -> Iterator[TrialRow]:
    """Kill `count` processes; with both kinds of stores, half in each."""
    parts = {Stores.SQLITE: kills.rows, Stores.POSTGRESQL: shared_kills.rows}
    wanted = list(parts) if stores is Stores.BOTH else [stores]
    for store in wanted:
        yield from parts[store](-(-count // len(wanted)), seed, say)
