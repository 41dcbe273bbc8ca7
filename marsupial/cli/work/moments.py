"""The work of `marsupial export`: find a moment of a mission in a log, or by running a scenario up to it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from marsupial.cli.work.missions import DEFAULT_SEED, warn_of
from marsupial.errors import UsageError
from marsupial.formats.files import file_fault
from marsupial.formats.loglines import FORMAT
from marsupial.formats.missionlog import read_log
from marsupial.generators.builtin import is_builtin
from marsupial.library.recording import Recorder
from marsupial.library.scenarios import load_scenario
from marsupial.model import Budget, MissionEvent

if TYPE_CHECKING:
    from marsupial.mission.rebuild import Moment

BUDGET = Budget(steps=4)  # budget of the greedy planner up to the moment: small, and in steps to be reproducible


def moment_of(source: str, at_s: float, *, carriers: int | None, rovers: int | None, seed: int | None) -> Moment:
    """Return the moment `at_s` seconds into a mission of a log or scenario that lasts at least as long."""
    if not (math.isfinite(at_s) and at_s >= 0):
        raise UsageError(f"--at: must be 0 or more, got {at_s:g}")
    at_ms = round(1000 * at_s)
    if not _is_log(source):
        events = _events_up_to(at_ms, source, carriers, rovers, DEFAULT_SEED if seed is None else seed)
    elif (carriers, rovers, seed) != (None, None, None):
        raise UsageError("--carriers, --rovers and --seed only apply to scenarios, not to logs")
    else:
        events = read_log(source).events
    from marsupial.mission.rebuild import moment_at  # imports compiled code, which takes long

    return moment_at(events, at_ms)


def _is_log(source: str) -> bool:
    path = Path(source)
    if is_builtin(source) or file_fault(path) is not None:
        return False
    if path.suffix.lower() == ".jsonl":
        return True
    with path.open("rb") as file:
        return f'"{FORMAT}"'.encode() in file.read(200)


def _events_up_to(
    at_ms: int, source: str, carriers: int | None, rovers: int | None, seed: int
) -> Sequence[MissionEvent]:
    """Run a scenario until something happens after `at_ms`, or to its end."""
    loaded = load_scenario(source, carriers, rovers)
    warn_of(loaded)
    from marsupial.library.missions import simulate

    recorder = Recorder()
    simulate(
        loaded.scenario,
        strategy="temporal",
        planner="greedy",
        budget=BUDGET,
        seed=seed,
        observer=recorder,
        cancelled=lambda: recorder.events[-1].t_ms > at_ms,
    )
    return recorder.events
