"""A wheel, installed into a clean environment, does its work from another directory.

The environment is filled from the package index, as a user's would be.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a command where nothing of this checkout is on the path, whatever other tests need there."""
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    words = [str(word) for word in command]
    return subprocess.run(words, cwd=cwd, env=env, capture_output=True, text=True, check=False)


def succeed(*command: str | Path, cwd: Path) -> str:
    done = run(*command, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder far from the checkout that holds ``env``, an environment with nothing but the wheel."""
    folder = tmp_path_factory.mktemp("elsewhere")
    succeed(sys.executable, "-m", "build", "--wheel", "--outdir", folder, CHECKOUT, cwd=folder)
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "env", with_pip=True)
    succeed(folder / "env" / "bin" / "python", "-m", "pip", "install", "--quiet", wheel, cwd=folder)
    return folder


def test_an_installed_wheel_runs_a_mission_and_finds_its_files(elsewhere: Path) -> None:
    marsupial = elsewhere / "env" / "bin" / "marsupial"
    mission = ("run", "lobby", "--planner", "greedy", "--steps", "2", "--log", "lobby.jsonl", "--json")
    summary = json.loads(succeed(marsupial, *mission, cwd=elsewhere))
    assert (summary["status"], summary["coverage"]) == ("complete", 1.0)
    succeed(marsupial, "export", "lobby.jsonl", "--at", "5", "-o", "moment", cwd=elsewhere)
    assert "(domain marsupial)" in (elsewhere / "moment" / "domain.pddl").read_text()
    succeed(marsupial, "replay", "lobby.jsonl", "--html", "lobby.html", cwd=elsewhere)
    assert "<script" in (elsewhere / "lobby.html").read_text()
    assert "not installed" in succeed(marsupial, "planners", cwd=elsewhere)
    bench = ("bench", "planners", "--engine", "greedy", "--instance", "mission-lobby-*", "--budget", "0.1")
    assert "best known" in succeed(marsupial, *bench, cwd=elsewhere)


def test_an_installed_wheel_has_the_sources_in_c_that_benches_compile(elsewhere: Path) -> None:
    marsupial = elsewhere / "env" / "bin" / "marsupial"
    shown = succeed(marsupial, "bench", "paths", "--size", "64", "--repeats", "1", cwd=elsewhere)
    if shutil.which("cc") is None:
        assert shown.endswith("C is left out: there is no compiler (cc)\n")
    else:
        assert "C is left out" not in shown


def test_an_installed_wheel_is_a_typed_library(elsewhere: Path) -> None:
    program = (
        "import marsupial; from importlib.metadata import version; from importlib.resources import files;"
        "print(marsupial.__file__, marsupial.__version__ == version('marsupial'),"
        "files('marsupial').joinpath('py.typed').is_file());"
        "marsupial.explore('lobby', 'heuristic', steps=1).plot().savefig('lobby.png')"
    )
    where, *said = succeed(elsewhere / "env" / "bin" / "python", "-c", program, cwd=elsewhere).split()
    assert str(elsewhere) in where
    assert said == ["True", "True"]
    assert (elsewhere / "lobby.png").read_bytes().startswith(b"\x89PNG")


def test_the_client_is_installed_without_the_rest(tmp_path: Path) -> None:
    client = CHECKOUT / "services" / "marsupial_client"
    succeed(sys.executable, "-m", "build", "--wheel", "--outdir", tmp_path, client, cwd=tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env" / "bin" / "python"
    succeed(python, "-m", "pip", "install", "--quiet", wheel, cwd=tmp_path)
    program = (
        "import marsupial_client; from importlib.metadata import version; from importlib.resources import files;"
        "print(marsupial_client.__file__, marsupial_client.__version__ == version('marsupial-client'),"
        "files('marsupial_client').joinpath('py.typed').is_file(),"
        "files('marsupial_client').joinpath('pyproject.toml').is_file())"
    )
    where, *said = succeed(python, "-I", "-c", program, cwd=tmp_path).split()
    assert str(tmp_path) in where
    assert said == ["True", "True", "False"]
    installed = {
        package["name"] for package in json.loads(succeed(python, "-m", "pip", "list", "--format=json", cwd=tmp_path))
    }
    assert "marsupial-client" in installed
    assert not installed & {"marsupial", "numpy"}
