"""Compiled code on disk matches the current sources."""

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
    """Run a function of a package in a new process; return its output and how often code was loaded."""
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


@pytest.mark.parametrize("folder", ["near", "far"])
def test_code_is_recompiled_only_if_a_function_of_another_file_has_changed(run, tmp_path, folder):
    write(tmp_path / "near", outer=OUTER.format(package=folder))
    write(tmp_path / folder, inner=INNER.format(summand=10))
    assert [run("near"), run("near")] == [(12, 0), (12, 1)]
    write(tmp_path / folder, inner=INNER.format(summand=200))
    assert run("near") == (202, 0)


def test_the_watcher_is_notified_of_compiled_but_not_of_loaded_functions(run, tmp_path):
    watched = """
from marsupial import native
told = []
with native.watched(lambda *function: told.append(function)):
    from near.outer import outer
    outer(1)
print(told)
"""
    write(tmp_path / "near", outer=OUTER.format(package="near"), inner=INNER.format(summand=10))
    said = [
        subprocess.run([sys.executable, "-c", watched], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
        for _ in range(2)
    ]
    assert said == ["[('near.outer.outer', 0, 2), ('near.inner.inner', 1, 2)]\n", "[]\n"]
