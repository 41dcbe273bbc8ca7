"""`marsupial validate`: whether a plan solves a problem."""

from pathlib import Path
from typing import Annotated

import typer

from marsupial.cli.process.exit_codes import INVALID_PLAN


def validate(
    domain: Annotated[Path, typer.Argument(metavar="DOMAIN", help="The domain file that `marsupial export` writes.")],
    problem: Annotated[Path, typer.Argument(metavar="PROBLEM", help="A problem of that domain.")],
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="A plan in IPC format.")],
) -> None:
    """Check a plan and print its first violation, if any.

    Each violation has a time and an action. If a planner has rounded its
    times to hundredths of a second, the plan is first retimed within these
    digits, and a note says so.

    Example: marsupial export lobby -o moment

    marsupial plan moment/problem.pddl --budget 5 -o plan.txt

    marsupial validate moment/domain.pddl moment/problem.pddl plan.txt
    """
    from marsupial.cli.display.tables import print_text
    from marsupial.errors import PlanTextError, SituationError
    from marsupial.formats.files import about, read_text
    from marsupial.formats.pddl.plantext import read_plan
    from marsupial.formats.pddl.text import check_domain, read_problem
    from marsupial.planning.checker import check
    from marsupial.wording import counted

    domain_text, problem_text = read_text(domain, SituationError), read_text(problem, SituationError)
    plan_text = read_text(plan, PlanTextError)
    with about(domain):
        check_domain(domain_text)
    with about(problem):
        situation = read_problem(problem_text)
    with about(plan):
        reading = read_plan(plan_text, situation)
    actions = reading.plan.actions
    verdict = check(situation, reading.plan)
    if verdict.valid:
        print_text(f"valid: {counted(len(actions), 'action')}, makespan {verdict.makespan_ms / 1000:.3f} s\n")
    else:
        print_text(f"invalid: {verdict.violation}\n")
    if reading.mended:
        count = f"{len(reading.mended)} of {len(actions)}"
        print_text(f"retimed, as times were printed rounded: {count} actions; the first on {reading.mended[0]}\n")
    if not verdict.valid:
        raise typer.Exit(INVALID_PLAN)
