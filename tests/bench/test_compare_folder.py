import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.processes.compare_workers import GREEDY, HEURISTIC, Inventing, invented, lobby

from marsupial.bench.compare.conduct import conduct
from marsupial.bench.compare.folder import opened, read_curves, read_header, read_rows, read_timings
from marsupial.bench.compare.plan import Case, Comparison, Contender, Trial, digest, header_of, prepared
from marsupial.bench.compare.rows import CURVES, ROWS, TIMINGS
from marsupial.errors import InputError, UsageError
from marsupial.generators.builtin import builtin_scenario
from marsupial.model import Budget, Goal

FILES = ("rows.csv", "timings.csv", "coverage.csv")


def run(comparison: Comparison, out: Path, runner: Inventing | None = None, **options: tuple[str, ...]) -> Inventing:
    runner = runner or Inventing()
    conduct(comparison, runner, out, lambda row, done, total: None, **options)
    return runner


def contents(out: Path) -> dict[str, bytes]:
    return {name: (out / name).read_bytes() for name in FILES}


def test_every_mission_is_kept_with_its_times_and_coverage_in_the_order_of_the_plan(tmp_path: Path) -> None:
    comparison = lobby(runs=3)
    run(comparison, tmp_path)
    trials = list(comparison.trials())
    assert [row.trial for row in read_rows(tmp_path)] == trials
    assert list(read_rows(tmp_path)) == [invented(trial).row for trial in trials]
    assert list(read_timings(tmp_path)) == [invented(trial).timing for trial in trials]
    assert list(read_curves(tmp_path)) == [invented(trial).curve for trial in trials]


def test_pairs_come_together_and_seeds_one_after_the_other() -> None:
    trials = list(lobby(runs=2, carriers=(1, 2)).trials())
    assert [(t.seed, t.case.carriers, t.contender) for t in trials[:4]] == [
        (1, 1, GREEDY), (1, 1, HEURISTIC), (1, 2, GREEDY), (1, 2, HEURISTIC)
    ]  # fmt: skip
    assert {t.seed for t in trials[4:]} == {2}


def test_an_interrupted_comparison_resumes(tmp_path: Path) -> None:
    comparison = lobby(runs=3)
    run(comparison, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        run(comparison, tmp_path / "cut", Inventing(after=2))
    done = {row.trial for row in read_rows(tmp_path / "cut")}
    assert len(done) == 2
    second = run(comparison, tmp_path / "cut")
    assert set(second.asked) == set(comparison.trials()) - done
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")
    assert run(comparison, tmp_path / "cut").asked == []


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("cut", [1, 20, 60])
def test_a_file_truncated_anywhere_is_repaired(tmp_path: Path, name: str, cut: int) -> None:
    comparison = lobby(runs=2)
    run(comparison, tmp_path)
    whole = contents(tmp_path)
    (tmp_path / name).write_bytes(whole[name][:-cut])
    run(comparison, tmp_path)
    if name == "rows.csv":
        assert contents(tmp_path) == whole
    else:  # the row exists, so the mission is done; its times are lost
        assert (tmp_path / "rows.csv").read_bytes() == whole["rows.csv"]
        assert (tmp_path / name).read_bytes() == whole[name][: whole[name][:-cut].rfind(b"\n") + 1]


def test_times_without_a_row_are_forgotten_and_come_again(tmp_path: Path) -> None:
    comparison = lobby(runs=2)
    run(comparison, tmp_path)
    whole = contents(tmp_path)
    lines = whole["rows.csv"].splitlines(keepends=True)
    (tmp_path / "rows.csv").write_bytes(b"".join(lines[:-1]))
    second = run(comparison, tmp_path)
    assert len(second.asked) == 1
    assert contents(tmp_path) == whole


def test_failed_missions_are_kept_with_their_reason_and_done_again_only_if_asked(tmp_path: Path) -> None:
    comparison = lobby(runs=2)
    unlucky = next(comparison.trials())
    run(comparison, tmp_path, Inventing(failing={unlucky: "crashed"}))
    row = next(row for row in read_rows(tmp_path) if row.trial == unlucky)
    assert (row.status, row.reason, row.exploration_time_s) == ("crashed", "no luck", None)
    assert run(comparison, tmp_path).asked == []
    assert run(comparison, tmp_path, drop=("crashed",)).asked == [unlucky]
    assert all(row.complete for row in read_rows(tmp_path))


@pytest.mark.parametrize(
    "grown",
    [
        lobby(runs=3),
        lobby(runs=2, carriers=(2, 1)),
        lobby(runs=2, contenders=(HEURISTIC, Contender("assignment"), GREEDY)),
        replace(lobby(runs=2), paper="wurm2010"),
    ],
)
def test_a_folder_can_grow_and_what_is_done_is_not_done_again(tmp_path: Path, grown: Comparison) -> None:
    run(lobby(runs=2), tmp_path / "small")
    run(grown, tmp_path / "at once")
    assert set(run(grown, tmp_path / "small").asked) == set(grown.trials()) - set(lobby(runs=2).trials())
    assert contents(tmp_path / "small") == contents(tmp_path / "at once")
    assert read_header(tmp_path / "small") == read_header(tmp_path / "at once")
    assert run(grown, tmp_path / "small").asked == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: replace(c, runs=1), "runs: the folder has 2, asked for is 1"),
        (
            lambda c: replace(c, budget=Budget(steps=2)),
            "budget: the folder has {'steps': 1}, asked for is {'steps': 2}",
        ),
        (lambda c: replace(c, contenders=(GREEDY,)), "contenders: the folder has ['temporal (greedy)', 'heuristic']"),
        (lambda c: replace(c, scenarios=lobby(carriers=(2,)).scenarios), "cases: the folder has lobby 1x1, asked"),
        (
            lambda c: replace(
                c, scenarios={k: replace(s, goal=Goal(return_home=True)) for k, s in c.scenarios.items()}
            ),
            "cases: another map, team or goal under the same name: lobby 1x1",
        ),
        (
            lambda c: replace(c, scenarios={k: replace(s, interference=True) for k, s in c.scenarios.items()}),
            "cases: another map, team or goal under the same name: lobby 1x1",
        ),
    ],
)
def test_a_folder_is_not_resumed_by_another_comparison(tmp_path: Path, change, message: str) -> None:
    run(lobby(), tmp_path)
    before = contents(tmp_path)
    with pytest.raises(UsageError) as caught:
        run(change(lobby()), tmp_path)
    assert message in str(caught.value)
    assert "choose another --out" in str(caught.value)
    assert contents(tmp_path) == before


def test_a_folder_is_not_resumed_by_another_version(tmp_path: Path) -> None:
    run(lobby(), tmp_path)
    header = json.loads((tmp_path / "comparison.json").read_text())
    (tmp_path / "comparison.json").write_text(json.dumps(header | {"marsupial": "0.0.1"}))
    with pytest.raises(UsageError, match=r"marsupial: the folder has 0\.0\.1"):
        run(lobby(), tmp_path)


def test_two_processes_do_not_write_to_one_folder(tmp_path: Path) -> None:
    header = header_of(lobby())
    with (
        opened(tmp_path, header),
        pytest.raises(UsageError, match="another process is at work"),
        opened(tmp_path, header),
    ):
        pass


def test_rows_without_a_head_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("mine\n")
    with pytest.raises(UsageError, match=r"has rows but no comparison\.json"):
        run(lobby(), tmp_path)
    assert (tmp_path / "rows.csv").read_text() == "mine\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("comparison.json", "{", "no JSON"),
        ("comparison.json", "[" * 100_000, "no JSON"),
        ("comparison.json", '{"runs": 1e999}', "no JSON"),
        ("comparison.json", "[]", "is not the head of a comparison"),
        ("comparison.json", '{"format": "marsupial-comparison", "version": 9}', "is of version 9"),
        ("comparison.json", '{"format": "marsupial-comparison", "version": 1}', "is damaged"),
        ("rows.csv", "a,b\n", "line 1: these are not the columns"),
        ("rows.csv", ROWS.head + "lobby,temporal\n", "line 2: can't be read"),
        ("rows.csv", ROWS.head + "lobby,temporal,greedy,one,1,1" + "," * 20 + "\n", "line 2: can't be read"),
    ],
)
def test_a_damaged_folder_is_named_with_the_place(tmp_path: Path, name: str, text: str, message: str) -> None:
    run(lobby(), tmp_path)
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        run(lobby(), tmp_path)
    assert str(tmp_path / name) in str(caught.value)
    assert message in str(caught.value)


def test_a_digest_depends_on_map_and_team() -> None:
    scenario = prepared(builtin_scenario("lobby", 1, 1))
    cells = scenario.grid.cells.copy()
    cells[0, 0] ^= 1
    others = [
        scenario,
        replace(scenario, grid=replace(scenario.grid, cells=cells)),
        replace(scenario, robot_types=scenario.robot_types[::-1]),
        replace(scenario, start_seed=1),
        prepared(builtin_scenario("lobby", 1, 2)),
    ]
    assert len({digest(other) for other in others}) == len(others)
    assert digest(scenario) == digest(prepared(builtin_scenario("lobby", 1, 1)))


NAMES = st.text(st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp", "Zs"]), min_size=1, max_size=12)


@given(NAMES, NAMES, st.floats(allow_nan=False, allow_infinity=False), st.lists(st.integers(0, 10_000)))
def test_records_read_back_as_they_were_written(name: str, planner: str, number: float, known: list[int]) -> None:
    trial = Trial(Case(name, 3, 2), Contender("temporal", planner), 7)
    result = invented(trial)
    records = (
        (ROWS, replace(result.row, distance_m=number, reason="a,b\"c'd")),
        (TIMINGS, replace(result.timing, cpu_s=number)),
        (CURVES, replace(result.curve, known=tuple(known))),
    )
    for lines, record in records:
        assert lines.decode(next(csv.reader([lines.encode(record)]))) == record
