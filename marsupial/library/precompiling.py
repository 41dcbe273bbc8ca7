"""Compile what missions and planners use ahead of time: ``python -m marsupial.library.precompiling [FOLDER]``.

The code goes into FOLDER, or the package's own, and runs on any machine with the same operating system, Python and
numba (`marsupial.codecache`). New processes compile it, for a processor that nearly all machines have: numba reads
which one from the environment when it is imported.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from marsupial.codecache import PRECOMPILED, precompile_into, processor_environment
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.choices import DEFAULT_PLANNER
from marsupial.library.first_use import ONE_STEP, SMALL_MAP, try_mission, try_planner
from marsupial.library.missions import simulate
from marsupial.library.recording import LogFile
from marsupial.model.robots import Routes
from marsupial.model.scenario import with_routes
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import RULES

JOBS = 2  # processes that compile at once


def precompile(folder: Path) -> int:
    """Replace a folder's precompiled code; return the number of files, 0 without a shared processor to compile for."""
    for file in folder.glob("*.code"):
        file.unlink()
    folder.mkdir(parents=True, exist_ok=True)
    environment = processor_environment()
    if not environment:
        return 0
    # Code that calls Intel's vector library would fail to load on machines without it.
    environment = {**os.environ, **environment, "NUMBA_DISABLE_INTEL_SVML": "1"}
    command = [sys.executable, "-m", __spec__.name, "--job"]
    jobs = [subprocess.Popen([*command, str(job), folder], env=environment) for job in range(JOBS)]
    if failed := [job for job in jobs if job.wait()]:
        raise subprocess.CalledProcessError(failed[0].returncode, failed[0].args)
    return len(list(folder.iterdir()))


def compile_here(job: int, folder: Path) -> None:
    """Run one process's share of trials, and write what they compile into a folder."""
    # The searches of `anytime` and `exact` take longest to compile, so each process gets one of them.
    precompile_into(folder)
    if job == 0:
        try_planner("anytime")
        strategies: tuple[str, ...] = ("temporal", CLAIRVOYANT)
    else:
        # Routes of least energy, and a log: no other trial compiles these.
        scenario = with_routes(builtin_scenario(SMALL_MAP, carriers=2, rovers=1), Routes.ENERGY)
        with tempfile.TemporaryDirectory(prefix="marsupial-") as logs, LogFile(Path(logs, "log.jsonl")) as log:
            simulate(scenario, strategy="heuristic", planner=DEFAULT_PLANNER, budget=ONE_STEP, seed=1, observer=log)
        try_planner("exact")
        strategies = ("heuristic", "heuristic-plus", "assignment", *RULES)
    for strategy in strategies:
        try_mission(strategy, DEFAULT_PLANNER, rovers=strategy not in RULES)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--job"]:
        compile_here(int(sys.argv[2]), Path(sys.argv[3]))
    else:
        print("precompiling, for half a minute to a minute ...", flush=True)
        print(f"{precompile(Path(sys.argv[1]) if sys.argv[1:] else PRECOMPILED)} functions precompiled")
