import os
from pathlib import Path

import pytest

from marsupial.cli.main import main
from marsupial.errors import UsageError
from marsupial.formats.files import make_folder, write_file


def test_a_file_is_replaced_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    target = tmp_path / "plan.txt"
    target.write_text("old")
    write_file(target, "new\n")
    assert target.read_bytes() == b"new\n"
    assert [path.name for path in tmp_path.iterdir()] == ["plan.txt"]


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "plan.txt"
    target.write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(UsageError, match=r"can't write .*: no space left on device"):
        write_file(target, "new")
    assert target.read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["plan.txt"]


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"can't write .*nowhere/plan\.txt: no such file or directory"):
        write_file(tmp_path / "nowhere" / "plan.txt", "")
    with pytest.raises(UsageError, match="is a directory"):
        write_file(tmp_path, "")
    (tmp_path / "out").write_text("")
    with pytest.raises(UsageError, match=r"can't make the folder .*out: file exists"):
        make_folder(tmp_path / "out")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_log_on_a_full_disk_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "lobby", "--planner", "greedy", "--steps", "1", "--log", "/dev/full"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines()[-1] == "error: can't write /dev/full: no space left on device"


@pytest.mark.parametrize(
    "command",
    [
        "run FILE --log FILE",
        "plan FILE -o FILE",
        "replay FILE --html FILE",
        "replay OTHER FILE --html FILE",
        "map FILE --out LINK",
        "map STEM.yaml --clean STEM",
        "ros FILE --log FILE",
    ],
)
def test_no_command_writes_over_the_file_that_it_reads(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, link = tmp_path / "mine.png", tmp_path / "link.png"
    file.write_text("kept")
    link.symlink_to(file)
    stem, other = tmp_path / "own", tmp_path / "other.jsonl"
    stem.with_suffix(".yaml").write_text("kept")
    names = {"FILE": str(file), "LINK": str(link), "OTHER": str(other), "STEM": str(stem), "STEM.yaml": f"{stem}.yaml"}
    assert main([names.get(word, word) for word in command.split()]) == 2
    assert "would write over a file that the command reads" in capsys.readouterr().err
    assert file.read_text() == stem.with_suffix(".yaml").read_text() == "kept"
