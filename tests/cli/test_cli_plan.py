import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from support.planning.situations import one_room, two_rooms

from marsupial.cli.main import main
from marsupial.formats.pddl.plantext import read_plan_text
from marsupial.formats.pddl.text import problem_text
from marsupial.formats.situation import situation_to_json
from marsupial.model.objective import MAKESPAN, Objective
from marsupial.model.plan import ActionName, Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning import engines
from marsupial.planning.checker import check
from marsupial.planning.greedy import serve

GREEDY = ("--planner", "greedy", "--steps", "2")

OPTIMAL = "makespan 19.002 s, optimal (to 1 ms, with 1 ms between the actions of a robot)"


class Scripted:
    """An engine that yields a script of events."""

    info = EngineInfo(name="scripted", anytime=True, deterministic_steps=True)

    def __init__(self, *events: Improved | Finished) -> None:
        self._events = events

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        yield from self._events


@pytest.fixture
def room(tmp_path: Path) -> str:
    path = tmp_path / "situation.json"
    path.write_text(situation_to_json(one_room()))
    return str(path)


def script(monkeypatch: pytest.MonkeyPatch, *events: Improved | Finished) -> None:
    monkeypatch.setattr(engines, "ENGINES", {"scripted": lambda: Scripted(*events)})


def test_the_best_plan_goes_to_stdout_and_is_valid(capsys: pytest.CaptureFixture[str], room: str) -> None:
    assert main(["plan", room, *GREEDY]) == 0
    captured = capsys.readouterr()
    assert check(one_room(), read_plan_text(captured.out, one_room())).valid
    assert "makespan" in captured.err


def test_a_problem_in_pddl_gives_the_same_plan(capsys: pytest.CaptureFixture[str], room: str, tmp_path: Path) -> None:
    path = tmp_path / "problem.pddl"
    path.write_text(problem_text(one_room()))
    outs = []
    for source in (room, str(path)):
        assert main(["plan", source, *GREEDY]) == 0
        outs.append(capsys.readouterr().out)
    assert outs[0] == outs[1]


def test_the_plan_can_go_to_a_file(capsys: pytest.CaptureFixture[str], room: str, tmp_path: Path) -> None:
    target = tmp_path / "plan.txt"
    assert main(["plan", room, *GREEDY, "-o", str(target)]) == 0
    assert capsys.readouterr().out == ""
    assert check(one_room(), read_plan_text(target.read_text(), one_room())).valid


def test_json_holds_every_proposal_and_the_plan(capsys: pytest.CaptureFixture[str], room: str) -> None:
    assert main(["plan", room, *GREEDY, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["planner"], answer["outcome"]) == ("greedy", "satisficing")
    assert answer["makespan_s"] == min(proposal["makespan_s"] for proposal in answer["proposals"])
    assert read_plan_text(answer["plan"], one_room()).makespan_ms == round(1000 * answer["makespan_s"])


@pytest.mark.parametrize(
    ("outcome", "code"),
    [(Outcome.UNSOLVABLE, 4), (Outcome.TIMEOUT, 5), (Outcome.MEMORY, 5), (Outcome.CRASHED, 5), (Outcome.NO_PLAN, 5)],
)
def test_an_engine_without_a_plan_has_its_exit_code(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    room: str,
    tmp_path: Path,
    outcome: Outcome,
    code: int,
) -> None:
    script(monkeypatch, Finished(outcome=outcome, detail="it was like this"))
    target = tmp_path / "plan.txt"
    assert main(["plan", room, "--planner", "scripted", "-o", str(target)]) == code
    assert f"scripted: {outcome}: it was like this" in capsys.readouterr().err
    assert not target.exists()


def test_a_plan_the_checker_refuses_is_not_given_out(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, room: str
) -> None:
    script(monkeypatch, Improved(plan=Plan(actions=()), elapsed_s=0.1), Finished(outcome=Outcome.SATISFICING))
    assert main(["plan", room, "--planner", "scripted"]) == 6
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "refused: 0.000 s, at the end: " in captured.err


def test_a_valid_plan_among_refused_ones_is_kept(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, room: str
) -> None:
    good, _ = serve(one_room())
    script(
        monkeypatch,
        Improved(plan=good, elapsed_s=0.1),
        Improved(plan=Plan(actions=()), elapsed_s=0.2),
        Finished(outcome=Outcome.CRASHED),
    )
    assert main(["plan", room, "--planner", "scripted"]) == 0
    assert read_plan_text(capsys.readouterr().out, one_room()) == good


def test_the_default_planner_is_auto_and_an_optimal_makespan_is_reported(
    capsys: pytest.CaptureFixture[str], room: str
) -> None:
    assert main(["plan", room, "--steps", "2"]) == 0
    *_, outcome, judgement = capsys.readouterr().err.splitlines()
    assert outcome.startswith("auto: optimal: plan by anytime")
    assert judgement == OPTIMAL


def test_an_engine_without_proofs_is_compared_with_a_bound(capsys: pytest.CaptureFixture[str], room: str) -> None:
    assert main(["plan", room, *GREEDY]) == 0
    assert capsys.readouterr().err.splitlines()[-1] == OPTIMAL
    assert main(["plan", room, *GREEDY, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["lower_bound_s"], answer["gap"]) == (19.002, 0.0)


def begun_late(plan: Plan, ms: int) -> Plan:
    return Plan(actions=tuple(replace(action, start_ms=action.start_ms + ms) for action in plan.actions))


@pytest.mark.parametrize("bound_ms", [None, 12_000, 50_000])
def test_the_gap_is_what_the_makespan_has_above_the_best_bound_that_can_be_true(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, room: str, bound_ms: int | None
) -> None:
    late = begun_late(serve(one_room())[0], 998)
    script(
        monkeypatch, Improved(plan=late, elapsed_s=0.1), Finished(outcome=Outcome.SATISFICING, lower_bound_ms=bound_ms)
    )
    assert main(["plan", room, "--planner", "scripted", "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err.splitlines()[-1] == "makespan 20.000 s, bound 19.002 s, gap 5.0 %"
    answer = json.loads(captured.out)
    assert (answer["lower_bound_s"], answer["gap"]) == (19.002, pytest.approx(0.0499))


def test_of_two_plans_as_long_the_one_that_reaches_targets_sooner_is_kept(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    plan, _ = serve(two_rooms())
    first = next(action for action in plan.actions if action.name is ActionName.EXPLORE)
    waits = replace(first, start_ms=first.start_ms + 1)
    later = Plan.of(waits if action is first else action for action in plan.actions)
    script(
        monkeypatch,
        Improved(plan=later, elapsed_s=0.1),
        Improved(plan=plan, elapsed_s=0.1),
        Finished(outcome=Outcome.SATISFICING),
    )
    path = tmp_path / "situation.json"
    path.write_text(situation_to_json(two_rooms()))
    assert later.makespan_ms == plan.makespan_ms
    assert main(["plan", str(path), "--planner", "scripted"]) == 0
    assert read_plan_text(capsys.readouterr().out, two_rooms()) == plan
