"""Compile what missions and planners use before anybody waits for it: ``python -m marsupial.library.precompiling``.

The code goes into the package's folder for it (`marsupial.keeping`), or one that is named, and runs on any machine with
the same operating system, Python and numba. Compiling goes on in processes of their own, for a processor that nearly
all machines can stand for.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from marsupial.generators.builtin import builtin_scenario
from marsupial.keeping import PRECOMPILED, precompile_into, processor_environment
from marsupial.library.choices import DEFAULT_PLANNER
from marsupial.library.first_use import CARRIERS, ONE_STEP, SMALL_MAP, try_mission, try_planner
from marsupial.library.missions import simulate
from marsupial.library.recording import LogFile
from marsupial.model.robots import Routes
from marsupial.model.scenario import with_routes
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import RULES

JOBS = 2
"""Processes that compile at once."""


def precompile(folder: Path) -> int:
    """Have new processes compile into a folder, in place of what it held; return how many files there are.

    There are none where nobody knows a processor that other machines have as well.
    """
    for file in folder.glob("*.code"):
        file.unlink()
    folder.mkdir(parents=True, exist_ok=True)
    environment = processor_environment()
    if not environment:
        return 0
    environment = {**os.environ, **environment, "NUMBA_DISABLE_INTEL_SVML": "1"}
    command = [sys.executable, "-m", __spec__.name, "--job"]
    jobs = [subprocess.Popen([*command, str(job), folder], env=environment) for job in range(JOBS)]
    failed = [job for job in jobs if job.wait()]
    if failed:
        raise subprocess.CalledProcessError(failed[0].returncode, failed[0].args)
    return len(list(folder.iterdir()))


def compile_here(job: int, folder: Path) -> None:
    """Use what one of the processes is to compile, and write its code into a folder.

    What takes longest to compile, the searches of `anytime` and `exact`, is begun in different processes.
    """
    precompile_into(folder)
    if job == 0:
        try_planner("anytime")
        _try_missions(("temporal", CLAIRVOYANT))
    else:
        _try_missions(("heuristic", "heuristic-plus", "assignment", *RULES))
        _try_log_and_energy()
        try_planner("exact")


def _try_missions(strategies: Iterable[str]) -> None:
    for strategy in strategies:
        try_mission(strategy, DEFAULT_PLANNER, rovers=strategy not in RULES)


def _try_log_and_energy() -> None:
    """Have a mission with routes of least energy written to a log."""
    scenario = with_routes(builtin_scenario(SMALL_MAP, CARRIERS, 1), Routes.ENERGY)
    with tempfile.TemporaryDirectory(prefix="marsupial-") as logs, LogFile(Path(logs, "log.jsonl")) as log:
        simulate(scenario, strategy="heuristic", planner=DEFAULT_PLANNER, budget=ONE_STEP, seed=1, observer=log)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--job"]:
        compile_here(int(sys.argv[2]), Path(sys.argv[3]))
    else:
        print("precompiling, for half a minute to a minute ...", flush=True)
        print(f"{precompile(Path(sys.argv[1]) if sys.argv[1:] else PRECOMPILED)} functions precompiled")
