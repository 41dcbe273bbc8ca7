"""What a planner costs once per process is paid before any budget counts.

Compiled code is loaded, or compiled where this machine has never run it, by planning for a tiny team; the process that
starts other planners imports their libraries. Both run in the background until the caller waits for them.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from threading import Thread

import numpy as np

from marsupial.model.planning import Budget
from marsupial.model.robots import Role
from marsupial.model.situation import PlanningType, RobotState, Situation, SituationGoal, TargetInfo
from marsupial.planning.engines import PRELOAD, PROCESSES, engine
from marsupial.planning.external.commands import PREFIX
from marsupial.processes.launcher import warm_up

FALLBACK = "greedy"
"""What missions continue with where another planner has no plan, and what the others begin with."""

_SILENT_S = 2.0


def prepare(planner: str, say: Callable[[str], None] = lambda text: None) -> Callable[[], None]:
    """Begin to get a planner ready and return what waits until it is; `say` is told if that takes long."""
    has_processes = planner in PROCESSES or planner.startswith(PREFIX)
    if has_processes:
        warm_up(wait=False, preload=PRELOAD)
    trial = Thread(target=_try_out, args=(FALLBACK if has_processes else planner,), daemon=True)
    trial.start()

    def wait() -> None:
        if has_processes:
            warm_up()
        trial.join(_SILENT_S)
        if trial.is_alive():
            say("compiling the planner, which is done once on a machine ...")
            trial.join()

    return wait


def _try_out(planner: str) -> None:
    with suppress(Exception):  # the call that needs it reports it
        for _ in engine(planner).solve(_tiny(), Budget(steps=1)):
            pass


def _tiny() -> Situation:
    """Return one that needs a bit of everything: setting down, exploring twice, picking up, driving home."""
    times = np.full((6, 6), 1000, dtype=np.int64)
    return Situation(
        types=(
            PlanningType(name="carrier", role=Role.CARRIER, capacity=1),
            PlanningType(name="rover", role=Role.ROVER, dock_ms=1000, undock_ms=1000),
        ),
        robots=(
            RobotState(name="carrier1", type="carrier", place="start", home="home"),
            RobotState(name="rover1", type="rover", carrier="carrier1"),
        ),
        targets=tuple(TargetInfo(name=name, explorers=frozenset({"rover"})) for name in ("target1", "target2")),
        meetings=("meeting1", "meeting2"),
        homes=("home",),
        travel_ms={"carrier": times, "rover": times},
        goal=SituationGoal(recover_rovers=True, return_home=True),
    )
