"""docs/tutorial.md and docs/examples.md: their commands work in order in a new folder, and print what is shown."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from servers import Server
from waiting import HANG_S

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture
def shell(tmp_path: Path) -> dict[str, str]:
    """The environment of a user who has installed marsupial."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "marsupial"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m marsupial.cli.main "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    return os.environ | {"PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "100"}


def done(command: list[str], folder: Path, environment: dict[str, str]) -> str:
    run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=HANG_S)
    assert run.returncode == 0, f"{command}\n{run.stdout}\n{run.stderr}"
    return run.stdout


def test_every_command_works_and_prints_what_is_shown(tmp_path: Path, shell: dict[str, str]) -> None:
    folder = tmp_path / "workshop"
    shutil.copytree(ROOT / "docs" / "tutorial", folder)
    printed = ""
    for language, block in BLOCKS.findall(TEXT):
        if language == "python":
            done([sys.executable, "-c", block], folder, shell)
        elif language == "sh" and "pip install" not in block and "serve" not in block:
            printed = done(
                ["bash", "-euc", block.replace("--runs 3", "--runs 1")], folder, shell
            )  # 3 take half a minute
        elif language == "text":
            shown = [line.strip() for line in block.splitlines() if line.strip(" .─")]
            missing = set(shown) - {line.strip() for line in printed.splitlines()}
            assert not missing, printed
    assert {"workshop.html", "moment", "plan.txt", "comparison"} <= {path.name for path in folder.iterdir()}


def test_the_worked_examples_print_what_is_shown(tmp_path: Path, shell: dict[str, str]) -> None:
    printed = ""
    for language, block in BLOCKS.findall((ROOT / "docs" / "examples.md").read_text(encoding="utf-8")):
        if language == "sh":
            printed = done(["bash", "-euc", block], tmp_path, shell | {"COLUMNS": "250"})
        elif language == "text":
            assert {line.strip() for line in block.splitlines()} <= {line.strip() for line in printed.splitlines()}


def test_a_service_runs_the_same_mission(tmp_path: Path, shell: dict[str, str]) -> None:
    shutil.copytree(ROOT / "docs" / "tutorial", tmp_path, dirs_exist_ok=True)
    (edit,) = (block for language, block in BLOCKS.findall(TEXT) if language == "python")
    done([sys.executable, "-c", edit], tmp_path, shell)
    map_file = (tmp_path / "workshop.yaml").read_text(encoding="utf-8")
    (tmp_path / "mended.yaml").write_text(map_file.replace("workshop.png", "mended.png"), encoding="utf-8")
    (command,) = (line for line in TEXT.splitlines() if "--server" in line)
    with Server(tmp_path / "served") as server:
        printed = done(["bash", "-euc", command.replace("http://127.0.0.1:8080", server.url)], tmp_path, shell)
    assert "exploration time  0:58" in printed


def test_the_scenario_in_the_text_is_the_file(tmp_path: Path) -> None:
    (shown,) = (block for language, block in BLOCKS.findall(TEXT) if language == "yaml")
    file = (ROOT / "docs" / "tutorial" / "workshop-team.yaml").read_text(encoding="utf-8")
    assert [re.sub(r"\s+#.*", "", line) for line in shown.splitlines()] == file.splitlines()
