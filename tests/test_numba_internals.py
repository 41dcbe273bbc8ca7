"""numba's internals are used where they are known, and done without where they are not."""

import subprocess
import sys
from pathlib import Path

import pytest

from marsupial import numba_internals

SOURCE = """
from marsupial.native import inlined, native

@inlined
def doubled(number):
    return 2 * number

@native
def sum_of(number):
    return doubled(number) + 1
"""
CALL = "from near.sums import sum_of; print(sum_of(3), sum(sum_of.stats.cache_hits.values()))"


def test_the_internals_of_this_numba_are_known() -> None:
    assert numba_internals._difference() is None  # else adapt marsupial.numba_internals, or raise NEWEST


@pytest.mark.parametrize(
    ("change", "difference"),
    [
        ("import numba; numba.__version__ = '0.99.1'", "numba 0.99.1 is newer than 0."),
        (
            "from numba.core.caching import FunctionCache as C; load = C._load_overload;"
            "C._load_overload = lambda me, *rest: load(me, *rest)",
            "has another FunctionCache._load_overload",
        ),
    ],
    ids=["newer", "another method"],
)
def test_with_another_numba_code_is_compiled_and_stored_by_numba_alone_and_one_line_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str, difference: str
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "near").mkdir()
    (tmp_path / "near" / "sums.py").write_text(SOURCE)
    command = [sys.executable, "-c", f"{change}; {CALL}"]
    first, later = (subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True) for _ in range(2))
    assert (first.stdout, later.stdout) == ("7 0\n", "7 1\n")
    (line,) = first.stderr.splitlines()
    assert difference in line
    assert "compiling takes longer" in line
    assert later.stderr == ""
