"""Pages with commands: these work in order in a new folder, and print what is shown; all pages name real options."""

import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from PIL import Image
from support.waiting import HANG_S

from marsupial.cli.main import app, main

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHORTER = {
    "--runs 3": "--runs 1",
    "--runs 5": "--runs 1",
    "--rovers 1-4": "--rovers 1-2",
    "compare office": "compare lobby",
    "--planner tamer --budget 10": "--planner greedy",
    "run map.yaml": "run map.yaml --steps 8",
}
"""What would take half a minute or more, and what stands for it here."""


def shorter(block: str) -> str:
    for long, short in SHORTER.items():
        block = block.replace(long, short)
    return block


def done(*command: str) -> str:
    run = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S)
    assert run.returncode == 0, f"{command}\n{run.stdout}\n{run.stderr}"
    return run.stdout


@pytest.fixture
def paste(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[[str], str]:
    """Run the lines of a block in the folder of the test, those of the program in this process; return the output."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "250")

    def run(block: str) -> str:
        printed = ""
        for line in shorter(block).splitlines():
            if line.startswith("marsupial "):
                assert main(shlex.split(line, comments=True)[1:]) == 0, (line, capsys.readouterr().err)
                printed += capsys.readouterr().out
            else:
                printed += done("bash", "-euc", line)
        return printed

    return run


def test_every_command_works_and_prints_what_is_shown(tmp_path: Path, paste: Callable[[str], str]) -> None:
    shutil.copytree(ROOT / "docs" / "tutorial", tmp_path, dirs_exist_ok=True)
    printed = ""
    for language, block in BLOCKS.findall(TEXT):
        if language == "python":
            done(sys.executable, "-c", block)
        elif language == "sh" and "pip install" not in block and "serve" not in block:
            printed = paste(block)
        elif language == "text":
            shown = [line.strip() for line in block.splitlines() if line.strip(" .─")]
            missing = set(shown) - {line.strip() for line in printed.splitlines()}
            assert not missing, printed
    assert {"workshop.html", "moment", "plan.txt", "comparison"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize("page", ["examples", "coming-from"])
def test_the_commands_of_a_page_print_what_is_shown(page: str, tmp_path: Path, paste: Callable[[str], str]) -> None:
    write_room(tmp_path)
    printed = ""
    for language, block in BLOCKS.findall((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")):
        if language == "sh":
            printed = paste("".join(line for line in block.splitlines(keepends=True) if "marsupial ros" not in line))
        elif language == "text":
            assert {line.strip() for line in block.splitlines()} <= {line.strip() for line in printed.splitlines()}


def test_the_page_for_vehicle_routing_says_by_how_much_a_plan_may_exceed_the_optimum(
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = (ROOT / "docs" / "coming-from.md").read_text(encoding="utf-8")
    (statement,) = re.findall(r"^print\(f\"at most .*$", page, re.MULTILINE)
    exec(statement, {"plans": SimpleNamespace(gap=0.5)})  # a plan of 100 s, a bound of 50 s
    assert capsys.readouterr().out == "at most 100% above the optimum\n"


def write_room(folder: Path) -> None:
    """Write `map.yaml`, the user's map of some pages."""
    room = Image.new("L", (48, 36), 0)
    room.paste(254, (2, 2, 46, 34))
    room.save(folder / "map.png")
    (folder / "map.yaml").write_text(
        "image: map.png\nresolution: 0.25\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )


PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "services").rglob("*.md")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_command_of_a_page_is_one_of_the_program(page: Path) -> None:
    for language, block in BLOCKS.findall(page.read_text(encoding="utf-8")):
        if language in ("", "sh", "console"):
            for line in block.splitlines():
                if line.removeprefix("$ ").startswith("marsupial "):
                    parse(shlex.split(line.removeprefix("$ ").rstrip(" &"), comments=True)[1:])


def parse(words: list[str]) -> None:
    """Parse a command line without doing it. Raises KeyError, or what the program would report."""
    command = typer.main.get_command(app)
    while (commands := getattr(command, "commands", None)) and words and not words[0].startswith("-"):
        command, words = commands[words[0]], words[1:]
    command.make_context("marsupial", words)


def test_the_scenario_in_the_text_is_the_file() -> None:
    (shown,) = (block for language, block in BLOCKS.findall(TEXT) if language == "yaml")
    file = (ROOT / "docs" / "tutorial" / "workshop-team.yaml").read_text(encoding="utf-8")
    assert [re.sub(r"\s+#.*", "", line) for line in shown.splitlines()] == file.splitlines()
