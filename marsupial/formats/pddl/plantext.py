"""Plans as text, in the format of the planning competitions (IPC): ``12.001: (move r1 rover_type s1 m1) [5.000]``.

What is written holds whole milliseconds and reads back as the same plan. What is read may come from any planner:
any case, durations left out, ``1.2e+01``, comments, blank lines, LPG's ``[D:5.00; C:0.10]`` and the bracket too much
at the end of each line of its plan files. See `marsupial.formats.pddl.plansteps` for how times become milliseconds.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction

from marsupial.errors import PlanTextError, Problem
from marsupial.formats.pddl.facts import seconds
from marsupial.formats.pddl.numbers import exact
from marsupial.formats.pddl.plansteps import Reading, Step, reading_of, steps_of
from marsupial.model.plan import Plan
from marsupial.model.situation import Situation
from marsupial.wording import counted

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]{1,3})?"
_DURATION = rf"\[\s*(?:({_NUMBER})\s*|d:\s*({_NUMBER})\s*;[^\]]*)\](?:\s*\))?\s*"
_LINE = re.compile(rf"({_NUMBER})\s*:\s*\(\s*([^\s()]+)((?:\s+[^\s()]+)*)\s*\)\s*(?:{_DURATION})?(?:;.*)?")

_ROUNDED_TO = -2
"""Exponent of the last digit of times that count as rounded: LPG's hundredths of a second. Whole milliseconds are
exact, and a plan with fewer digits was written by a person, who means what it says."""


def write_plan_text(plan: Plan, situation: Situation) -> str:
    """Return a plan for `situation` in IPC format, after a header of comments.

    A drive of a robot that is still busy starts at once and takes as much longer, as `path_cost` says.

    Raises
    ------
    InvalidPlanError
        If an action names a robot there is none of, or starts before its robot is free.
    """
    lines = [f"; {counted(len(plan.actions), 'action')}, makespan {seconds(plan.makespan_ms)} s"]
    lines += [_line(step) for step in steps_of(plan, situation)]
    return "\n".join([*lines, ""])


def read_plan_text(text: str, situation: Situation) -> Plan:
    """Return the plan for `situation` that a text in IPC format holds; see `read_plan`."""
    return read_plan(text, situation).plan


def read_plan(text: str, situation: Situation) -> Reading:
    """Return the plan for `situation` that a text in IPC format holds, and what of it had been rounded away.

    It is not checked whether it is valid.

    Raises
    ------
    PlanTextError
        With every line that can't be read.
    """
    problems: list[Problem] = []
    steps = list(_steps(text, problems))
    reading: Reading | None = None
    try:
        reading = reading_of(steps, situation)
    except PlanTextError as error:
        problems += error.problems
    if problems or reading is None:
        raise PlanTextError(sorted(problems, key=lambda problem: int(problem.path.removeprefix("line "))))
    return reading


def _line(step: Step) -> str:
    start, duration = (seconds(int(time * 1000)) for time in (step.start, step.duration or Fraction(0)))
    return f"{start}: ({' '.join((step.name, *step.args))}) [{duration}]"


def _steps(text: str, problems: list[Problem]) -> Iterator[Step]:
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip().lower()
        if not line or line.startswith(";"):
            continue
        match = _LINE.fullmatch(line)
        if match is None:
            message = f"'<seconds>: (<action> ...) [<seconds>]' is expected, got {raw.strip()!r}"
            problems.append(Problem(f"line {number}", message))
            continue
        start, name, args, *durations = match.groups()
        duration = next(filter(None, durations), None)
        try:
            times = exact(start), None if duration is None else exact(duration)
        except ValueError as fault:
            problems.append(Problem(f"line {number}", f"a time in seconds is expected: {fault}"))
            continue
        yield Step(
            start=times[0],
            name=name,
            args=tuple(args.split()),
            duration=times[1],
            where=f"line {number}",
            start_off=_off(start),
            duration_off=Fraction(0) if duration is None else _off(duration),
        )


def _off(number: str) -> Fraction:
    """Return by how many seconds a printed time may differ from the true one."""
    return Fraction(1, 200) if Decimal(number).as_tuple().exponent == _ROUNDED_TO else Fraction(0)
