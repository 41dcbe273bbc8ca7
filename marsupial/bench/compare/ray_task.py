"""One mission of a comparison as a task of Ray: what a worker needs for it, and what it must be.

Rows of different versions must not get into one file unnoticed. So each task states requirements, and a worker that
can't meet them refuses.
"""

import os
import pickle
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from marsupial.bench.compare.plan import Case, OwnStrategy, Trial
from marsupial.bench.compare.rows import Result
from marsupial.bench.compare.trial import carry_out
from marsupial.model import Budget, Scenario
from marsupial.versions import versions


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirements:
    """Requirements for a worker: the same versions and, with `token`, that it serves no client without a token."""

    versions: Mapping[str, str]
    token: bool


class WorkerMismatch(Exception):
    """A worker does not meet the requirements; the message says which machine and why."""


def attend(trial: Trial, store: Sequence[Any], budget: Budget, requirements: Requirements) -> Result:
    """Run a mission on a worker of Ray; raise a `WorkerMismatch` if the worker does not meet `requirements`.

    `store`: the reference to the pickled scenarios and own strategies, in a sequence, as Ray would resolve a bare one
    for each task.
    """
    check_requirements(requirements)
    scenarios, own = unpacked(store[0])
    return carry_out(trial, scenarios[trial.case], budget, own)


@lru_cache(maxsize=1)
def unpacked(reference: Any) -> tuple[Mapping[Case, Scenario], Mapping[str, OwnStrategy]]:
    """Fetch the scenarios and own strategies from Ray, once per process."""
    import ray

    found: tuple[Mapping[Case, Scenario], Mapping[str, OwnStrategy]] = pickle.loads(ray.get(reference))
    return found


def check_requirements(requirements: Requirements) -> None:
    """Raise `WorkerMismatch` if this process does not meet `requirements`."""
    here = platform.node()
    if requirements.token and os.environ.get("RAY_AUTH_MODE", "").lower() != "token":
        raise WorkerMismatch(f"node {here} accepts clients without a token; start it with RAY_AUTH_MODE=token")
    ours = versions()
    differences = [f"{name} {ours[name]} instead of {wanted}" for name, wanted in requirements.versions.items()
                   if ours[name] != wanted]  # fmt: skip
    if differences:
        raise WorkerMismatch(f"node {here} has {', '.join(differences)}; install the same versions on all nodes")
