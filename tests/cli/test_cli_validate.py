import re
from pathlib import Path

import pytest

from marsupial.cli.main import main

PDDL = Path(__file__).resolve().parents[2] / "pddl"
DOMAIN, PROBLEM = str(PDDL / "domain.pddl"), str(PDDL / "examples" / "deploy" / "problem.pddl")


@pytest.mark.parametrize(
    ("plan", "code", "told"), [("valid-first", 0, r"valid: 5 actions"), ("invalid-no-gap", 6, r"invalid: .* s, \(")]
)
def test_a_plan_is_valid_or_its_first_violation_is_printed_with_time_and_action(
    plan: str, code: int, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", DOMAIN, PROBLEM, str(PDDL / "examples" / "deploy" / f"{plan}.plan")]) == code
    assert re.match(told, capsys.readouterr().out)


@pytest.mark.parametrize("broken", [0, 1, 2])
def test_the_file_that_is_broken_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str], broken: int) -> None:
    files = [DOMAIN, PROBLEM, str(PDDL / "examples" / "deploy" / "valid-first.plan")]
    wrong = tmp_path / "wrong"
    wrong.write_text("(define (what\n")
    files[broken] = str(wrong)
    assert main(["validate", *files]) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"error: {wrong}: line ")


def test_another_domain_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    domain = tmp_path / "domain.pddl"
    domain.write_text(Path(DOMAIN).read_text().replace("(define (domain marsupial)", "(define (domain other)"))
    plan = PDDL / "examples" / "deploy" / "valid-first.plan"
    assert main(["validate", str(domain), PROBLEM, str(plan)]) == 3
    assert "not the canonical domain" in capsys.readouterr().err


def test_a_plan_with_rounded_times_is_retimed_with_a_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = tmp_path / "plan.txt"
    plan.write_text(
        "0.00: (MOVE ROBOT0 CARRIER_TYPE P M1) [D:5.00; C:0.10]\n"
        "5.00: (UNDOCK ROBOT1 ROBOT0 M1) [D:5.00; C:0.10]\n"
        "10.00: (EXPLORE ROBOT1 ROVER_TYPE M1 T2) [D:8.00; C:0.10]\n"
        "10.00: (EXPLORE ROBOT0 CARRIER_TYPE M1 T3) [D:10.00; C:0.10]\n"
        "20.00: (EXPLORE ROBOT0 CARRIER_TYPE T3 T1) [D:23.00; C:0.10]\n"
    )
    assert main(["validate", DOMAIN, PROBLEM, str(plan)]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first == "valid: 5 actions, makespan 43.003 s"
    assert second == (
        "retimed, as times were printed rounded: 4 of 5 actions; "
        "the first on line 2: (undock robot1 robot0 m1) from 5.001 for 5.000 s"
    )
