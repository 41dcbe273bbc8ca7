"""What a job's worker is given, and what it sends back."""

from __future__ import annotations

from dataclasses import dataclass

from marsupial.model.objective import Value
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget
from marsupial_service.schemas.words import JobOutcome


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerTask:
    """One attempt at a job.

    Parameters
    ----------
    task
        Pickled; only the worker opens it.
    engine
        The name for `marsupial.planning.engines.engine`.
    start
        The best plan of earlier attempts; only better ones are sent back.
    """

    task: bytes
    engine: str
    budget: Budget
    start: Plan | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysed:
    """What the worker found on a map: the situation and its places, both as JSON text."""

    situation: str
    places: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A plan that the checker accepts and that is better than all before it; its actions as JSON text, and as IPC."""

    score: Value
    makespan_ms: int
    actions: str
    ipc: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """The worker's own word on how the job ended."""

    outcome: JobOutcome
    detail: str = ""
    lower_bound_ms: int | None = None
