import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from support.planning.situations import one_hall

from marsupial.cli import main as program
from marsupial.cli.main import main
from marsupial.cli.process.interrupt import Interrupted
from marsupial.errors import InternalError
from marsupial.formats.situation import situation_to_json
from marsupial.strategies.clairvoyant import CLAIRVOYANT
from marsupial.strategies.registry import strategy_names

COMMANDS = (
    "run", "replay", "compare", "reproduce", "plan", "export", "validate", "map", "strategies", "planners", "scenarios",
    "bench", "demo", "ros", "serve", "help",
)  # fmt: skip
STORES = tuple(f"serve store {name}" for name in ("info", "backup", "restore", "retain"))
KEYS = tuple(f"serve keys {name}" for name in ("add", "list", "revoke"))
ALL_COMMANDS = (*(name for name in COMMANDS if name != "bench"), "bench planners", *KEYS, *STORES)


def break_planners(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def fail() -> None:
        raise error

    monkeypatch.setattr("marsupial.planning.engines.engine_infos", fail)


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"\n  {command} " in out for command in COMMANDS)
    assert not [line for line in out.splitlines()[1:] if line.endswith("...")]


APART = ("compare", "reproduce", "demo", "ros", "serve", *STORES, "bench planners")
"""Commands whose examples take minutes, never end, or need a fleet or a store; other tests cover them."""


@pytest.mark.parametrize("command", ALL_COMMANDS)
def test_every_command_has_an_example_on_lines_that_can_be_pasted(
    capsys: pytest.CaptureFixture[str], command: str
) -> None:
    example = example_of(capsys, command)
    assert example[-1].startswith(f"marsupial {command}")
    for line in example:
        named = next(name for name in sorted(ALL_COMMANDS, key=len, reverse=True) if f"marsupial {name} " in f"{line} ")
        given = [word for word in shlex.split(line) if word.startswith("--")]
        assert main([*named.split(), "--help"]) == 0
        told = capsys.readouterr().out
        assert all(f"{option} " in told for option in given), line


SHORTER = {
    "office": "lobby", "--budget 5": "--budget 0.1", "--log": "--steps 1 --log", "lobby.gif": "lobby.gif --speed 100"
}  # fmt: skip
"""What would take seconds, and what stands for it here."""


@pytest.mark.parametrize("command", [name for name in ALL_COMMANDS if name not in APART])
def test_examples_work_as_pasted_into_an_empty_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for line in example_of(capsys, command):
        for long, short in SHORTER.items():
            line = line.replace(long, short)
        assert main(shlex.split(line)[1:]) == 0, (line, capsys.readouterr().err)


def example_of(capsys: pytest.CaptureFixture[str], command: str) -> list[str]:
    """Return the commands of the example in the help of a command."""
    assert main([*command.split(), "--help"]) == 0
    _, _, after = capsys.readouterr().out.partition("Example: ")
    lines = [line.strip() for line in re.split(r"Options:|Arguments:", after)[0].splitlines()]
    return [line for line in lines if line]


@pytest.mark.parametrize("command", ["run", "compare"])
def test_help_of_commands_that_take_strategies_lists_them_all(capsys: pytest.CaptureFixture[str], command: str) -> None:
    assert main([command, "--help"]) == 0
    told = re.split(r"[\s,.]+", re.sub(r"-\n\s+", "-", capsys.readouterr().out))  # lines may end after a hyphen
    assert {*strategy_names(), CLAIRVOYANT} <= set(told)


def test_help_has_long_lists_of_options_in_groups_and_arguments_without_braces(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for command, headings in (
        ("run", ["Arguments", "Planning", "Team and mission", "Output"]),
        ("compare", ["Arguments", "Strategies and planning", "Maps, teams and missions", "Running and output"]),
        ("planners", ["Options"]),
    ):
        assert main([command, "--help"]) == 0
        told = capsys.readouterr().out
        assert re.findall(r"^(\w.*):$", told, re.MULTILINE) == headings
        assert "{" not in told.splitlines()[0]


def test_help_is_a_command_too(capsys: pytest.CaptureFixture[str]) -> None:
    for words, asked in ((("help",), ()), (("help", "run"), ("run",)), (("help", "serve", "keys"), ("serve", "keys"))):
        assert main(words) == main([*asked, "--help"]) == 0
        first, _, second = capsys.readouterr().out.partition("\nUsage: ")
        assert first == f"Usage: {second}".rstrip("\n")
    assert main(["help", "nonsense"]) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run", "lobby", "--seed", "-1"), "--seed: must be 0 or more, got -1"),
        (("run", "lobby", "--resolution", "0"), "--resolution: must be positive, got 0.0"),
        (("compare", "lobby", "--runs", "0", "--out", "x"), "--runs: must be 1 or more, got 0"),
        (("compare", "lobby", "--workers", "2000", "--out", "x"), "--workers: must be at most 1024, got 2000"),
        (("replay", "x.jsonl", "--speed", "0.01"), "--speed: must be 0.1 or more, got 0.01"),
        (("serve", "--port", "70000"), "--port: must be at most 65535, got 70000"),
    ],
)
def test_a_number_out_of_bounds_is_refused_in_plain_words(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    assert main(arguments) == 2
    assert capsys.readouterr().err == f"error: {message}\n"


LIGHT = (
    "--version", "planners", "scenarios", "strategies", "strategies --json", "nonsense", "map nonsense",
    "plan nonsense", *(f"{name} --help" for name in ("run", "compare", "map", "plan", "export", "validate")),
    *(f"{name} --help" for name in ("reproduce", "demo", "serve", "ros", "bench", "bench planners")),
    "run nonsense", "run office --nonsense", "run office --strategy nonsense", "run office --planner nonsense",
    "replay nonsense", "export nonsense -o nowhere", "reproduce nonsense --out nowhere", "bench nonsense",
    "bench planners --nonsense", "compare office --out nowhere --strategies nonsense",
)  # fmt: skip


def imported(heavy: tuple[str, ...], *commands: str) -> list[str]:
    """Return which of these modules each command imports in a new process."""
    code = (
        "import sys, marsupial.cli.main as m\n"
        f"for words in {commands}:\n"
        "    m.main(words.split())\n"
        f"    print('imported by', words, [name for name in {heavy} if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return [line for line in done.stdout.splitlines() if line.startswith("imported by ")]


def test_help_lists_and_mistyped_names_import_no_compiler_and_no_solver() -> None:
    assert imported(("numpy", "numba", "scipy", "yaml", "unified_planning"), "--help") == ["imported by --help []"]
    heavy = ("numba", "scipy", "matplotlib", "unified_planning")
    assert imported(heavy, *LIGHT) == [f"imported by {one} []" for one in LIGHT]


def test_a_mission_that_asks_no_planner_imports_no_solver_and_nothing_that_only_compiling_needs() -> None:
    heavy = ("scipy.linalg", "scipy.optimize", "scipy.sparse", "scipy.ndimage", "numba.np.arraymath", "matplotlib")
    heavy += ("marsupial.bench", "marsupial.planning.local_search", "marsupial.planning.branch_and_bound")
    mission = "run lobby --strategy heuristic"
    imported((), mission)  # compiles
    assert imported((*heavy, "unified_planning"), mission) == [f"imported by {mission} []"]


def test_the_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("marsupial 0.")


@pytest.mark.parametrize("arguments", [["fly"], ["run", "--nonsense"], ["bench"], ["bench", "nothing"]])
def test_a_wrong_command_line_is_a_usage_error(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err


def test_an_internal_error_prints_a_line_and_writes_the_traceback_to_a_file(
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


def test_an_interrupted_command_prints_a_message(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    break_planners(monkeypatch, Interrupted())
    assert main(["planners"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("runn office", "run"),
        ("serve kys", "keys"),
        ("bench pathz", "paths"),
        ("run office --plannr greedy", "--planner"),
        ("run offic", "office"),
        ("run office --strategy temporl", "temporal"),
        ("compare office --out nowhere --strategies temporal,huristic", "heuristic"),
        ("run office --planner gredy", "greedy"),
        ("plan nowhere.json --planner gredy", "greedy"),
        ("reproduce wurm2011 --out nowhere", "wurm2010"),
        ("serve --limit slts=1", "slots"),
    ],
)
def test_a_typo_gets_a_suggestion(
    words: str, meant: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "nowhere.json").write_text(situation_to_json(one_hall()))
    assert main(words.split()) in (2, 3)
    told = capsys.readouterr().err
    assert re.search(rf"(did you mean|Did you mean|Possible options:) '?{meant}", told), told
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("module", ["marsupial", program.__name__])
def test_the_program_can_be_run_as_a_module(module: str) -> None:
    command = [sys.executable, "-m", module, "scenarios"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "lobby" in done.stdout
