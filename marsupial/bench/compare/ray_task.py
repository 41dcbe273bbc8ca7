"""The task of a Ray worker: one mission, if worker and caller have the same version installed."""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from marsupial.bench.compare.plan import Case, Trial
from marsupial.bench.compare.rows import Result
from marsupial.bench.compare.trial import carry_out
from marsupial.cluster.make import Terms, demand
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario


def attend(trial: Trial, scenarios: Sequence[Any], budget: Budget, terms: Terms) -> Result:
    """Run a mission on a worker.

    Parameters
    ----------
    scenarios
        The reference to the comparison's pickled scenarios, in a sequence: Ray would resolve a bare reference per task.

    Raises
    ------
    WorkerRefused
        If the worker does not meet `terms`.
    """
    demand(terms)
    return carry_out(trial, _unpacked(scenarios[0])[trial.case], budget)


@lru_cache(maxsize=1)
def _unpacked(reference: Any) -> Mapping[Case, Scenario]:
    """Fetch the scenarios, once per process."""
    import ray

    found: Mapping[Case, Scenario] = pickle.loads(ray.get(reference))
    return found
