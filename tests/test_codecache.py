"""The cache of compiled code, and precompiled code in the package."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from marsupial.codecache import processor_environment

SOURCE = """
from marsupial.native import native

@native
def add(number):
    return number + {summand}
"""

CALL = "from near.sums import add; print(add(1), sum(add.stats.cache_hits.values()))"
"""Prints the sum and the number of loads of compiled code."""

UNWRITABLE = {"HOME": "/proc/none", "XDG_CACHE_HOME": "/proc/none"}


def write(folder: Path, summand: int) -> None:
    (folder / "near").mkdir(exist_ok=True)
    (folder / "near" / "sums.py").write_text(SOURCE.format(summand=summand))


def run(folder: Path, code: str = CALL, **environment: str) -> tuple[str, str]:
    """Run code beside the package in a new process; return stdout and stderr."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_C")}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=folder, env=inherited | environment, check=True, capture_output=True, text=True)
    return done.stdout.strip(), done.stderr.strip()


@pytest.fixture
def read_only(tmp_path: Path) -> Path:
    """Return the folder of the package, in which code can't be stored."""
    write(tmp_path, 10)
    (tmp_path / "near" / "__pycache__").touch()
    return tmp_path


def test_a_temporary_folder_is_the_last_resort_for_compiled_code_and_is_reported_once(read_only: Path) -> None:
    temporary = read_only / "temporary"
    temporary.mkdir()
    where = {**UNWRITABLE, "TMPDIR": str(temporary)}
    told = f"compiled code is kept in {temporary / f'marsupial-{os.getuid()}'}: the folders for it can't be written to"
    assert run(read_only, **where) == ("11 0", told)
    assert run(read_only, **where) == ("11 1", "")


def test_without_a_writable_folder_compiled_code_is_not_stored_and_that_is_reported_once(read_only: Path) -> None:
    told = "compiled code is not kept: there is no folder that can be written to"
    code = f"import tempfile; tempfile.tempdir = '/proc/none'; {CALL}; add(1.5)"
    assert run(read_only, code, **UNWRITABLE) == ("11 0", told)


def test_a_temporary_folder_that_others_can_write_to_is_not_used(read_only: Path) -> None:
    folder = read_only / "temporary" / f"marsupial-{os.getuid()}"
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert run(read_only, **UNWRITABLE, TMPDIR=str(folder.parent))[0] == "11 0"
    assert list(folder.parent.iterdir()) == [folder]
    assert not list(folder.iterdir())


def test_a_full_disk_is_reported_once_and_ends_nothing(tmp_path: Path) -> None:
    write(tmp_path, 10)
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"
    said, told = run(tmp_path, f"{full}; {CALL}; add(1.5)", PYTHONDONTWRITEBYTECODE="1")
    assert (said, told) == ("11 0", "compiled code is not kept: File too large")


def test_damaged_stored_code_is_recompiled(tmp_path: Path) -> None:
    write(tmp_path, 10)
    run(tmp_path)
    (kept,) = (tmp_path / "near" / "__pycache__").glob("*.nbc")
    kept.write_bytes(kept.read_bytes()[:100])
    assert [run(tmp_path)[0], run(tmp_path)[0]] == ["11 0", "11 1"]


@pytest.fixture(scope="module")
def precompiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where the package is, with its precompiled code in a folder beside it."""
    folder = tmp_path_factory.mktemp("precompiled")
    (folder / "code").mkdir()
    write(folder, 10)
    environment = processor_environment()
    if not environment:
        pytest.skip("there is no processor that code is precompiled for here")
    into = "import pathlib; from marsupial import codecache; codecache.precompile_into(pathlib.Path('code').resolve())"
    assert run(folder, f"{into}; {CALL}", **environment) == ("11 0", "")
    return folder


def run_precompiled(folder: Path, kept: Path, change: str = "") -> str:
    """Run with the precompiled code of this folder and an empty cache; return the output."""
    place = f"pathlib.Path({str(folder)!r}, 'code')"
    found = f"import pathlib; from marsupial import codecache; codecache.PRECOMPILED = {place}"
    said, told = run(kept, f"{found}\n{change}\n{CALL}", NUMBA_CACHE_DIR=str(kept))
    assert not told
    return said


def test_precompiled_code_of_other_sources_is_not_used(precompiled: Path, tmp_path: Path) -> None:
    write(tmp_path, 200)
    assert run_precompiled(precompiled, tmp_path) == "201 0"


OTHERS = {
    "numba": "from types import SimpleNamespace as N; codecache.numba = N(__version__='0.1')",
    "numpy": "from types import SimpleNamespace as N; codecache.np = N(__version__='99.0')",
    "python": "from types import SimpleNamespace as N;codecache.sys = N(implementation=N(cache_tag='x'), abiflags='')",
    "processor": "from dataclasses import replace as r; from marsupial.codecache import PROCESSORS as ps;"
    "ps.update((name, r(p, features=frozenset({'no such'}))) for name, p in ps.items())",
    "processor asked for": "codecache.config.CPU_NAME = 'generic'",
}
"""Statements that change for what code is compiled."""

EACH = f"""
import os
for name, change in {OTHERS}.items():
    if os.fork() == 0:
        codecache.config.CACHE_DIR = os.path.abspath(name)
        exec(change)
        break
    os.wait()
"""
"""Goes on in a process for each change, and in one without."""


def test_precompiled_code_is_loaded_wherever_the_package_is_but_by_no_other(precompiled: Path, tmp_path: Path) -> None:
    write(tmp_path, 10)
    assert run_precompiled(precompiled, tmp_path, EACH).split("\n") == [*["11 0"] * len(OTHERS), "11 1"]
    assert not list(tmp_path.glob("*.nbc"))


def test_precompiled_code_that_is_damaged_is_not_used(precompiled: Path, tmp_path: Path) -> None:
    write(tmp_path, 10)
    (tmp_path / "code").mkdir()
    (file,) = (precompiled / "code").iterdir()
    (tmp_path / "code" / file.name).write_bytes(file.read_bytes()[:100])
    assert run_precompiled(tmp_path, tmp_path) == "11 0"
