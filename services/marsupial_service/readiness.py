"""Whether a worker can plan: a tiny situation, planned for and checked."""

from __future__ import annotations

from collections.abc import Iterator

from marsupial.model.planning import Budget, Improved
from marsupial.planning.checker import check
from marsupial.planning.engines import engine
from marsupial_service.jobs.warm import tiny


def plan_tiny(_: object) -> Iterator[bool]:
    """Yield whether planning gives a valid plan; the function of a job of `marsupial.processes.launcher`."""
    situation = tiny()
    plans = [e.plan for e in engine("greedy").solve(situation, Budget(steps=1)) if isinstance(e, Improved)]
    yield bool(plans) and check(situation, plans[-1]).valid
