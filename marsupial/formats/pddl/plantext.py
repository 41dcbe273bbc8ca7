"""Plans as text, in the format of the planning competitions (IPC): ``12.001: (move r1 rover_type s1 m1) [5.000]``.

Written plans have whole milliseconds and read back as the same plan. Plans to read may come from any planner: in any
case, without durations, with ``1.2e+01``, comments or blank lines, with LPG's ``[D:5.00; C:0.10]`` and its extra
bracket at the end of each line. `marsupial.formats.pddl.plansteps` explains how times become milliseconds.
"""

import re
from collections.abc import Iterator
from decimal import Decimal
from fractions import Fraction

from marsupial.errors import PlanTextError, Problem
from marsupial.formats.pddl.facts import exact, seconds
from marsupial.formats.pddl.plansteps import Reading, Step, reading_of, steps_of
from marsupial.model import Plan, Situation
from marsupial.wording import counted

# with one way only to match digits: else the time for a line would grow with the square of their number
_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:e[+-]?[0-9]{1,3})?"
_DURATION = rf"\[\s*(?:({_NUMBER})\s*|d:\s*({_NUMBER})\s*;[^\]]*)\](?:\s*\))?\s*"
_LINE = re.compile(rf"({_NUMBER})\s*:\s*\(\s*([^\s()]+)((?:\s+[^\s()]+)*)\s*\)\s*(?:{_DURATION})?(?:;.*)?")

# exponent of the last digit of times that count as rounded: LPG's hundredths of a second; milliseconds are exact, and a
# person wrote a plan with fewer digits, which is exact too
_ROUNDED_TO = -2


def write_plan_text(plan: Plan, situation: Situation) -> str:
    """Return a plan for `situation` in IPC format, after a header of comments."""
    # The first drive of a busy robot starts at 0 and takes longer by the rest of its running action, like `path_cost`.
    lines = [f"; {counted(len(plan.actions), 'action')}, makespan {seconds(plan.makespan_ms)} s"]
    lines += ["; batteries charge by themselves: no action says so"] if situation.batteries else []
    for step in steps_of(plan, situation):
        start, duration = (seconds(int(time * 1000)) for time in (step.start, step.duration or Fraction(0)))
        lines.append(f"{start}: ({' '.join((step.name, *step.args))}) [{duration}]")
    return "\n".join([*lines, ""])


def read_plan_text(text: str, situation: Situation) -> Plan:
    """Return the plan in a text in IPC format; see `read_plan`."""
    return read_plan(text, situation).plan


def read_plan(text: str, situation: Situation) -> Reading:
    """Return the plan in a text in IPC format, valid or not, and the actions whose rounded times were corrected."""
    problems: list[Problem] = []
    steps = list(_steps(text, problems))
    try:
        reading = reading_of(steps, situation)
        if not problems:
            return reading
    except PlanTextError as error:
        problems += error.problems
    raise PlanTextError(sorted(problems, key=lambda problem: int(problem.path.removeprefix("line "))))


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
    """Return the most seconds by which a printed time may differ from the true one."""
    return Fraction(1, 200) if Decimal(number).as_tuple().exponent == _ROUNDED_TO else Fraction(0)
