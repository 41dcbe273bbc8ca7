from __future__ import annotations

import json
from pathlib import Path

import pytest

from marsupial.bench import first_use
from marsupial.bench.first_use import (
    COMMANDS,
    INSTANCE,
    SITUATION,
    FirstUseRow,
    Use,
    bench_first_use,
    table,
    use,
    values,
)
from marsupial.bench.suite.catalogue import INSTANCES
from marsupial.cli.main import main
from marsupial.errors import UsageError
from marsupial.formats.situation import situation_to_json

ROW = FirstUseRow(
    name="run", command="marsupial run lobby", first=Use(cpu_s=30.0, wall_s=20.0), later=Use(cpu_s=2.0, wall_s=2.5)
)


def with_situation(folder: Path) -> Path:
    (folder / SITUATION).write_text(situation_to_json(INSTANCES[INSTANCE].situation()), encoding="utf-8")
    return folder


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_that_is_used_can_be(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(with_situation(tmp_path))
    assert main([*COMMANDS[name]]) == 0


def test_a_command_is_used_once_and_then_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(COMMANDS, "scenarios", ("scenarios",))
    monkeypatch.setattr(first_use, "PROGRAM", "import sys; assert sys.argv[1] == 'scenarios'")
    told: list[str] = []
    (row,) = bench_first_use(["scenarios"], repeats=1, tell=told.append)
    assert (row.name, row.command) == ("scenarios", "marsupial scenarios")
    assert min(row.first.cpu_s, row.first.wall_s, row.later.cpu_s, row.later.wall_s) > 0
    assert told == ["scenarios, nothing kept", "scenarios, again"]


def test_code_is_kept_in_the_folder_of_the_bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = "import os, pathlib; pathlib.Path(os.environ['NUMBA_CACHE_DIR']).mkdir()"
    monkeypatch.setattr(first_use, "PROGRAM", program)
    use((), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["cache"]


@pytest.mark.slow
def test_the_first_use_leaves_compiled_code_for_the_next_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")  # no precompiled code is for that
    use(COMMANDS["plan"], with_situation(tmp_path))
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nbc")}
    assert kept
    use(COMMANDS["plan"], tmp_path)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nbc")} == kept


def test_a_command_that_fails_is_told_with_what_it_says(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"marsupial plan .*situation\.json .*failed: error: .*situation\.json"):
        use(COMMANDS["plan"], tmp_path)


def test_an_unknown_command_is_refused_before_anything_runs() -> None:
    with pytest.raises(UsageError, match="no first use of 'demo' is measured; there are run, plan"):
        next(bench_first_use(["demo"]))


def test_the_table_and_json_tell_cpu_and_wall_time() -> None:
    line = table([ROW]).splitlines()[-1]
    assert line.split() == ["30.0", "20.0", "2.00", "2.50", "15.0x", "marsupial", "run", "lobby"]
    (told,) = json.loads(json.dumps(values([ROW])))
    assert (told["first"]["cpu_s"], told["later"]["wall_s"], told["ratio"]) == (30.0, 2.5, 15.0)
