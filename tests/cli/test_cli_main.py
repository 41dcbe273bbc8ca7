from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from marsupial.cli import main as program
from marsupial.cli.interrupt import Interrupted
from marsupial.cli.main import main
from marsupial.errors import InternalError

COMMANDS = (
    "run",
    "replay",
    "compare",
    "reproduce",
    "plan",
    "export",
    "validate",
    "map",
    "planners",
    "scenarios",
    "bench",
    "demo",
    "ros",
)


def break_planners(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def fail() -> None:
        raise error

    monkeypatch.setattr("marsupial.planning.engines.engine_infos", fail)


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"\n  {command} " in out for command in COMMANDS)
    assert not [line for line in out.splitlines()[1:] if line.endswith("...")]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(capsys: pytest.CaptureFixture[str], command: str) -> None:
    assert main([command, "--help"]) == 0
    assert f"Example: marsupial {command}" in capsys.readouterr().out


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys, marsupial.cli.main as m; m.main(['--help']); "
        "print([name for name in ('numpy', 'numba', 'scipy', 'yaml', 'unified_planning') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_version_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("marsupial 0.")


@pytest.mark.parametrize("arguments", [["fly"], ["run", "--nonsense"], ["bench"], ["bench", "nothing"]])
def test_a_wrong_command_line_is_a_usage_error(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err


def test_a_bug_is_confessed_in_a_line_with_the_traceback_in_a_file(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_planners(monkeypatch, ZeroDivisionError("oops"))
    assert main(["planners"]) == 70
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("internal error: ZeroDivisionError: oops; this is a bug")
    file = Path(line.rpartition(" ")[2])
    assert "Traceback" in file.read_text()
    file.unlink()


def test_where_no_file_can_be_written_the_traceback_is_shown(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", "/proc/none")
    break_planners(monkeypatch, ZeroDivisionError("oops"))
    assert main(["planners"]) == 70
    *traceback, line = capsys.readouterr().err.splitlines()
    assert "Traceback (most recent call last):" in traceback
    assert line == "internal error: ZeroDivisionError: oops"


def test_debug_shows_the_traceback(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    break_planners(monkeypatch, InternalError("oops"))
    assert main(["--debug", "planners"]) == 70
    assert "Traceback" in capsys.readouterr().err


def test_an_interrupted_command_says_so(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    break_planners(monkeypatch, Interrupted())
    assert main(["planners"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


def test_the_program_can_be_run_as_a_module() -> None:
    command = [sys.executable, "-m", program.__name__, "scenarios"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "lobby" in done.stdout
