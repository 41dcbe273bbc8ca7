"""What a Ray worker does: one mission, if the worker is of the same make as the caller.

Rows of different versions must not stand in one file without a word. So every mission comes with the terms under which
its row is wanted, and a worker that can't meet them refuses.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import marsupial
from marsupial.bench.compare.header import LIBRARIES
from marsupial.bench.compare.plan import Case, Trial
from marsupial.bench.compare.rows import Result
from marsupial.bench.compare.trial import carry_out
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario

ENGINES = ("unified-planning", "up-aries", "up-tamer")
"""Packages that missions depend on beside `LIBRARIES`, so far as they are installed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """What is asked of a worker: to be of the same make, and to serve no caller without a token if `token`."""

    make: Mapping[str, str]
    token: bool


class WorkerRefused(Exception):
    """A worker does not meet the terms; the message says which machine and why."""


def attend(trial: Trial, scenarios: Sequence[Any], budget: Budget, terms: Terms) -> Result:
    """Carry out a mission on a worker.

    Parameters
    ----------
    scenarios
        The one reference to the comparison's scenarios, pickled; in a sequence, so that Ray hands it over as it is.

    Raises
    ------
    WorkerRefused
        If the worker does not meet `terms`.
    """
    demand(terms)
    return carry_out(trial, _unpacked(scenarios[0])[trial.case], budget)


def demand(terms: Terms) -> None:
    """Raise `WorkerRefused` if this process does not meet `terms`."""
    here = platform.node()
    if terms.token and os.environ.get("RAY_AUTH_MODE", "").lower() != "token":
        raise WorkerRefused(f"the node {here} serves anybody without a token: start it with RAY_AUTH_MODE=token")
    ours = make()
    differences = [f"{name} {ours[name]} instead of {wanted}" for name, wanted in terms.make.items()
                   if ours[name] != wanted]  # fmt: skip
    if differences:
        raise WorkerRefused(f"the node {here} has {', '.join(differences)}: install the same everywhere")


@cache
def make() -> Mapping[str, str]:
    """Return what missions of this process depend on: versions, and a digest of marsupial's own source files."""
    return {
        "marsupial": f"{version('marsupial')} (source {_source()})",
        "Python": platform.python_version(),
        **{name: _version(name) for name in (*LIBRARIES, *ENGINES)},
    }


def _source() -> str:
    digest = hashlib.sha256()
    folder = Path(marsupial.__path__[0])
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:8]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "(none)"


@lru_cache(maxsize=1)
def _unpacked(reference: Any) -> Mapping[Case, Scenario]:
    """Fetch the scenarios, once for all missions of this process."""
    import ray

    found: Mapping[Case, Scenario] = pickle.loads(ray.get(reference))
    return found
