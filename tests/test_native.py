"""Compiled code that is kept on disk is that of the sources as they are."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

OUTER = """
from marsupial.native import native
from {package}.inner import inner

@native
def outer(number):
    return inner(number) + 1
"""
INNER = """
from marsupial.native import native

@native
def inner(number):
    return number + {summand}
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a function of a package in a process of its own; return what it says and how often code was loaded."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)

    def run(package: str) -> tuple[int, int]:
        code = f"from {package}.outer import outer; print(outer(1), sum(outer.stats.cache_hits.values()))"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True)
        result, loaded = map(int, done.stdout.split())
        return result, loaded

    return run


def write(folder: Path, **sources: str) -> None:
    folder.mkdir(exist_ok=True)
    for name, source in sources.items():
        (folder / f"{name}.py").write_text(source)


def run_read_only(folder: Path, temporary: Path | None) -> tuple[str, str]:
    """Run the function where numba can keep nothing, nor anybody if there is no folder for temporary files.

    Returns what is said on both outputs.
    """
    (folder / "near" / "__pycache__").touch()
    nowhere = {"HOME": "/proc/none", "XDG_CACHE_HOME": "/proc/none", "TMPDIR": str(temporary or folder)}
    environ = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"} | nowhere
    code = "from near.outer import outer; print(outer(1), sum(outer.stats.cache_hits.values()))"
    if temporary is None:
        code = f"import tempfile; tempfile.tempdir = '/proc/none'; {code}"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=environ, check=True, capture_output=True, text=True
    )
    return done.stdout.strip(), done.stderr.strip()


def test_what_can_be_kept_nowhere_else_is_kept_in_a_temporary_folder_and_said_so_once(tmp_path):
    write(tmp_path / "near", outer=OUTER.format(package="near"), inner=INNER.format(summand=10))
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    said, told = run_read_only(tmp_path, temporary)
    folder = temporary / f"marsupial-{os.getuid()}"
    assert (said, told) == ("12 0", f"compiled code is kept in {folder}: the folders for it can't be written to")
    assert run_read_only(tmp_path, temporary)[0] == "12 1"


def test_where_nothing_can_be_written_compiled_code_is_not_kept_and_that_is_said_once(tmp_path):
    write(tmp_path / "near", outer=OUTER.format(package="near"), inner=INNER.format(summand=10))
    told = "compiled code is not kept: there is no folder that can be written to"
    assert run_read_only(tmp_path, None) == ("12 0", told)


def test_a_temporary_folder_that_others_can_write_to_is_not_used(tmp_path):
    write(tmp_path / "near", outer=OUTER.format(package="near"), inner=INNER.format(summand=10))
    folder = tmp_path / "temporary" / f"marsupial-{os.getuid()}"
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert run_read_only(tmp_path, folder.parent)[0] == "12 0"
    assert list(folder.parent.iterdir()) == [folder]
    assert not list(folder.iterdir())


@pytest.mark.parametrize("folder", ["near", "far"])
def test_is_made_anew_only_where_a_function_of_another_file_has_changed(run, tmp_path, folder):
    write(tmp_path / "near", outer=OUTER.format(package=folder))
    write(tmp_path / folder, inner=INNER.format(summand=10))
    assert [run("near"), run("near")] == [(12, 0), (12, 1)]
    write(tmp_path / folder, inner=INNER.format(summand=200))
    assert run("near") == (202, 0)
