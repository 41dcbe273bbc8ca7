"""Files of the wrong kind are refused with a line that names them, never with a traceback."""

import random
from pathlib import Path

import pytest

from marsupial.cli.main import main

COMMANDS = (
    "map FILE", "run FILE --steps 1", "compare FILE --out OUT", "export FILE -o OUT", "replay FILE --html OUT",
    "plan FILE --steps 1", "validate FILE FILE FILE",
)  # fmt: skip

SUFFIXES = ("yaml", "map", "json", "jsonl", "pddl", "pgm", "scen", "txt")


def written(path: Path, content: str) -> Path:
    if content == "a directory":
        path.mkdir()
    elif content == "binary":
        path.write_bytes(random.Random(1).randbytes(3000))
    elif content != "nothing there":
        path.write_text({"empty": "", "words": "hello world\n", "a number": "42\n", "a list": "[1, [2]]\n"}[content])
    return path


@pytest.mark.parametrize("content", ["empty", "binary", "a directory", "words", "a number", "a list", "nothing there"])
@pytest.mark.parametrize("command", COMMANDS)
def test_wrong_files_are_refused_with_a_message(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, command: str, content: str
) -> None:
    for suffix in SUFFIXES:
        file = written(tmp_path / f"given.{suffix}", content)
        words = {"FILE": str(file), "OUT": str(tmp_path / "out")}
        code = main([words.get(word, word) for word in command.split()])
        told = capsys.readouterr()
        assert code in (2, 3), told.err
        assert file.name in told.err
        assert "internal error" not in told.err
        assert told.out == ""
        assert not (tmp_path / "out").exists()


def test_a_mission_log_as_a_map_is_refused_with_the_commands_that_read_logs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "log.jsonl").touch()
    assert main(["run", str(tmp_path / "log.jsonl")]) == 3
    assert "is a mission log, not a map: `marsupial replay` and `marsupial export` take it" in capsys.readouterr().err


@pytest.mark.parametrize("command", [("serve", "keys", "list"), ("serve", "keys", "add", "me")])
def test_a_file_is_no_folder_for_keys(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, command: tuple[str, ...]
) -> None:
    (tmp_path / "data").touch()
    assert main([*command, "--data", str(tmp_path / "data")]) == 2
    assert str(tmp_path / "data") in capsys.readouterr().err
