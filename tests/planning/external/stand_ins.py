"""Planners with a command line, written by tests, for `one_hall`."""

import shlex
import sys
from pathlib import Path

from support.planning.situations import one_hall
from support.waiting import HANG_S

from marsupial.model import Budget, Finished, Situation
from marsupial.planning.checker import check
from marsupial.planning.external.commands import External
from marsupial.planning.external.process_engine import Events

AMPLE = Budget(seconds=HANG_S)

# Two plans for `one_hall`: 30.001 s and, the far target first, 50.001 s.
GOOD = "0.000: (explore c1 carrier_type c1_start t1)  [10.000]\n10.001: (explore c1 carrier_type t1 t2)  [20.000]\n"
LONG = "0.000: (explore c1 carrier_type c1_start t2)  [30.000]\n30.001: (explore c1 carrier_type t2 t1)  [20.000]\n"
HALF = "0.000: (explore c1 carrier_type c1_start t1)  [10.000]\n"

PRELUDE = f"""
import os, signal, subprocess, sys, time
from pathlib import Path
GOOD, LONG, HALF = {GOOD!r}, {LONG!r}, {HALF!r}
def say(text):
    print(text, end="", flush=True)
def wait_for(name):
    while not (Path(__file__).parent / name).exists():
        time.sleep(0.01)
"""


def stand_in(folder: Path, body: str, places: str = "{domain} {problem}") -> str:
    """Write a fake planner in Python and return its engine name."""
    script = folder / "planner.py"
    script.write_text(PRELUDE + body)
    return f"cmd:{shlex.quote(sys.executable)} -SE {shlex.quote(str(script))} {places}"


def solve(
    name: str, situation: Situation | None = None, budget: Budget = AMPLE, **options: int
) -> tuple[list[int], Finished]:
    """Return the makespans of the plans, after checking that they are valid, and the end."""
    situation = one_hall() if situation is None else situation
    *improved, end = External(name, **options).solve(situation, budget)
    assert isinstance(end, Finished)
    makespans = []
    for event in improved:
        assert check(situation, event.plan).valid
        makespans.append(event.plan.makespan_ms)
    return makespans, end


def events_of(name: str, budget: Budget = AMPLE) -> Events:
    return External(name).solve(one_hall(), budget)


def next_makespan(events: Events) -> int:
    event = next(events)
    return event.plan.makespan_ms
