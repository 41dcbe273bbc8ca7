"""A wheel works outside the checkout: unpacked, and installed into a clean environment.

That environment is filled from the package index, as a user's would be, and compiles everything anew, which takes
minutes. The unpacked wheel uses the compiled code of the checkout.
"""

import json
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]
CLIENT = CHECKOUT / "services" / "marsupial_client"
BRIDGE = CHECKOUT / "services" / "marsupial_ros"


@dataclass(frozen=True, kw_only=True)
class Elsewhere:
    """A folder outside the checkout with a wheel's content, and a Python that imports from it."""

    folder: Path
    python: Path
    path: str = ""
    is_clean: bool = False

    def run(self, *words: str) -> str:
        """Run a Python program in the folder, without the checkout on its path."""
        return succeed(self.python, *words, cwd=self.folder, PYTHONPATH=self.path)

    def marsupial(self, *words: str) -> str:
        return self.run("-m", "marsupial.cli.main", *words)


def succeed(*command: str | Path, cwd: Path, **variables: str) -> str:
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, env={**os.environ, **variables}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def unpacked(project: Path, folder: Path) -> Elsewhere:
    """Build a wheel in this environment, and unpack it."""
    succeed(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=project, PYTHONPATH="")
    (wheel,) = folder.glob("*.whl")
    content = folder / "content"
    with zipfile.ZipFile(wheel) as file:
        file.extractall(content)
    added = [content / line for found in content.glob("*.pth") for line in found.read_text().split()]
    return Elsewhere(folder=folder, python=Path(sys.executable), path=os.pathsep.join(map(str, [content, *added])))


def installed(project: Path, folder: Path) -> Elsewhere:
    """Build a wheel as its users do, and install it into an environment with nothing else."""
    succeed(sys.executable, "-m", "build", "--wheel", "--outdir", folder, project, cwd=folder, PYTHONPATH="")
    (wheel,) = folder.glob("*.whl")
    venv.create(folder / "env", with_pip=True)
    python = folder / "env" / "bin" / "python"
    succeed(python, "-m", "pip", "install", "--quiet", wheel, cwd=folder, PYTHONPATH="")
    return Elsewhere(folder=folder, python=python, is_clean=True)


BOTH = [unpacked, pytest.param(installed, marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=BOTH)
def elsewhere(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Elsewhere:
    found: Elsewhere = request.param(CHECKOUT, tmp_path_factory.mktemp("elsewhere"))
    compiled = CHECKOUT / "marsupial" / "precompiled"
    if not found.is_clean and compiled.is_dir():
        shutil.copytree(compiled, Path(found.path, "marsupial", "precompiled"))
    return found


def test_a_wheel_runs_a_mission_and_finds_its_files(elsewhere: Elsewhere) -> None:
    mission = ("run", "lobby", "--planner", "greedy", "--steps", "2", "--log", "lobby.jsonl", "--json")
    summary = json.loads(elsewhere.marsupial(*mission))
    assert (summary["status"], summary["coverage"]) == ("complete", 1.0)
    elsewhere.marsupial("export", "lobby.jsonl", "--at", "5", "-o", "moment")
    assert "(domain marsupial)" in (elsewhere.folder / "moment" / "domain.pddl").read_text()
    elsewhere.marsupial("replay", "lobby.jsonl", "--html", "lobby.html")
    assert "<script" in (elsewhere.folder / "lobby.html").read_text()
    if elsewhere.is_clean:
        assert "not installed" in succeed(elsewhere.python.with_name("marsupial"), "planners", cwd=elsewhere.folder)
    bench = ("bench", "planners", "--engine", "greedy", "--instance", "mission-lobby-*", "--budget", "0.1")
    assert "best known" in elsewhere.marsupial(*bench)


def test_a_wheel_is_a_typed_library(elsewhere: Elsewhere) -> None:
    program = (
        "import marsupial; from importlib.metadata import version; from importlib.resources import files;"
        "print(marsupial.__file__, marsupial.__version__ == version('marsupial'),"
        "files('marsupial').joinpath('py.typed').is_file());"
        "marsupial.explore('lobby', 'heuristic', steps=1).plot().savefig('lobby.png')"
    )
    where, *said = elsewhere.run("-c", program).split()
    assert str(elsewhere.folder) in where
    assert said == ["True", "True"]
    assert (elsewhere.folder / "lobby.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("put", BOTH)
def test_the_client_is_a_wheel_without_the_rest(put: Callable[[Path, Path], Elsewhere], tmp_path: Path) -> None:
    client = put(CLIENT, tmp_path)
    program = (
        "import marsupial_client; from importlib.metadata import requires, version;"
        "from importlib.resources import files;"
        "print(marsupial_client.__file__, marsupial_client.__version__ == version('marsupial-client'),"
        "files('marsupial_client').joinpath('py.typed').is_file(), *requires('marsupial-client'))"
    )
    where, *said = client.run("-c", program).split()
    assert str(tmp_path) in where
    assert said[:2] == ["True", "True"]
    assert [name.partition(">")[0] for name in said[2:]] == ["httpx2"]
    if client.is_clean:
        listed = json.loads(client.run("-m", "pip", "list", "--format=json"))
        assert not {package["name"] for package in listed} & {"marsupial", "numpy"}


@pytest.mark.parametrize("put", BOTH)
def test_the_bridge_to_ros_is_a_wheel_without_compiler_and_planner(
    put: Callable[[Path, Path], Elsewhere], tmp_path: Path
) -> None:
    bridge = put(BRIDGE, tmp_path)
    program = (
        "import marsupial, marsupial_ros.bridge, marsupial_ros.settings; from importlib.metadata import requires;"
        "print(marsupial.__file__, *requires('marsupial-ros'))"
    )
    where, *said = bridge.run("-c", program).split("\n")[0].split()
    assert str(tmp_path) in where
    assert [name.partition(">")[0] for name in said[:4]] == ["httpx2", "numpy", "pillow", "pyyaml"]
    if bridge.is_clean:
        listed = json.loads(bridge.run("-m", "pip", "list", "--format=json"))
        assert not {package["name"] for package in listed} & {"marsupial", "numba", "scipy"}


def test_no_wheel_takes_files_of_another_with_it(elsewhere: Elsewhere, tmp_path: Path) -> None:
    folders = [elsewhere.folder, tmp_path / "client", tmp_path / "bridge"]
    for project, folder in zip((CLIENT, BRIDGE), folders[1:], strict=True):
        unpacked(project, folder)
    wheels = [wheel for folder in folders for wheel in folder.glob("*.whl")]
    names = [name for wheel in wheels for name in zipfile.ZipFile(wheel).namelist()]
    assert len(wheels) == 3
    assert len(set(names)) == len(names)
    # where all are installed, the packages of `marsupial` come first
    assert {"marsupial/__init__.py", "marsupial_client/__init__.py", "marsupial_ros/__init__.py"} <= set(names)
