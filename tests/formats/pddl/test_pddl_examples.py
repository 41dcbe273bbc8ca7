"""The examples in the folder pddl: all checkers accept each valid plan and refuse each invalid one."""

from pathlib import Path

import pytest
from support.planning.up_problem import up_validate

from marsupial.formats.pddl.plantext import read_plan_text, write_plan_text
from marsupial.formats.pddl.text import pddl_folder, problem_text, read_problem
from marsupial.model.situation import Situation
from marsupial.planning.checker import check

EXAMPLES = Path(str(pddl_folder())) / "examples"
PLANS = sorted(str(path.relative_to(EXAMPLES)) for path in EXAMPLES.glob("*/*.plan"))
PROBLEMS = sorted(path.parent.name for path in EXAMPLES.glob("*/problem.pddl"))


def _situation(name: str) -> Situation:
    return read_problem((EXAMPLES / name / "problem.pddl").read_text(encoding="utf-8"))


def test_there_are_examples() -> None:
    assert PROBLEMS == ["deploy", "replan", "retrieve", "return_home"]
    for name in PROBLEMS:
        kinds = {plan.partition("/")[2].split("-")[0].removesuffix(".plan") for plan in PLANS if plan.startswith(name)}
        assert kinds == {"valid", "invalid"}


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_problem_is_what_would_be_written_today(name: str) -> None:
    text = (EXAMPLES / name / "problem.pddl").read_text(encoding="utf-8")
    body = text[text.index("(define") :]
    assert problem_text(_situation(name), name=name) == body


@pytest.mark.parametrize("name", PLANS)
def test_a_plan_is_valid_or_invalid_as_its_name_says(name: str) -> None:
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    situation = _situation(name.partition("/")[0])
    plan = read_plan_text(text, situation)
    valid = name.partition("/")[2].startswith("valid")
    ours = check(situation, plan)
    assert ours.valid is valid, ours.violation
    theirs = up_validate(situation, plan)
    assert theirs.valid is valid, theirs.detail
    assert text.startswith("; ")


@pytest.mark.parametrize("name", [name for name in PLANS if "/valid" in name])
def test_a_valid_plan_is_written_as_it_stands(name: str) -> None:
    lines = (EXAMPLES / name).read_text(encoding="utf-8").splitlines()
    situation = _situation(name.partition("/")[0])
    written = write_plan_text(read_plan_text("\n".join(lines), situation), situation).splitlines()
    assert sorted(written[1:]) == sorted(lines[1:])
