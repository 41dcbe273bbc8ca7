"""A program that carries out a comparison on Ray with workers that misbehave.

``python ray_driver.py ADDRESS WORK FOLDER OUT``: WORK is a function of this module;
FOLDER holds marks of actions that happen only once.
"""

import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from support.processes.compare_workers import GREEDY, HEURISTIC, lobby

from marsupial.bench.compare.conduct import conduct
from marsupial.bench.compare.plan import Comparison, Trial
from marsupial.bench.compare.ray_cluster import cluster_at, usable
from marsupial.bench.compare.ray_pool import RayPool
from marsupial.bench.compare.ray_task import Requirements, attend, unpacked
from marsupial.bench.compare.rows import Result
from marsupial.model.planning import Budget


def comparison_in(folder: Path) -> Comparison:
    """Return a comparison whose scenario is named after a folder."""
    comparison = lobby(runs=4)
    ((case, scenario),) = comparison.scenarios.items()
    return replace(comparison, scenarios={case: replace(scenario, name=str(folder))})


def dies(trial: Trial, scenarios: Sequence[Any], budget: Budget, requirements: Requirements) -> Result:
    """Lose a worker and a node once each, and the worker of one mission always."""
    folder = Path(unpacked(scenarios[0])[0][trial.case].name)
    if trial.seed == 2 and trial.contender == GREEDY and is_first(folder / "worker"):
        os.kill(os.getpid(), signal.SIGKILL)
    if trial.seed == 3 and trial.contender == GREEDY and is_first(folder / "node"):
        os.kill(os.getppid(), signal.SIGKILL)
        os.kill(os.getpid(), signal.SIGKILL)
    if is_hopeless(trial):
        os.kill(os.getpid(), signal.SIGKILL)
    return attend(trial, scenarios, budget, requirements)


def differs(trial: Trial, scenarios: Sequence[Any], budget: Budget, requirements: Requirements) -> Result:
    """Fail as a worker with another version of marsupial."""
    other = dict(requirements.versions) | {"marsupial": "9.9"}
    return attend(trial, scenarios, budget, replace(requirements, versions=other))


def is_hopeless(trial: Trial) -> bool:
    return trial.seed == 4 and trial.contender == HEURISTIC


def is_first(mark: Path) -> bool:
    try:
        mark.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


if __name__ == "__main__":
    import ray_driver

    address, work, folder, out = sys.argv[1:]
    comparison = comparison_in(Path(folder))
    pool = RayPool(comparison, usable(cluster_at(address)), getattr(ray_driver, work))
    conduct(comparison, pool, Path(out), lambda row, done, total: None)
