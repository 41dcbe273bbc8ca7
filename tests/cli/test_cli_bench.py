from __future__ import annotations

import pytest

from marsupial.cli.main import main


def test_paths_are_timed_beside_scipy(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "paths", "--size", "96", "--repeats", "1"]) == 0
    out = capsys.readouterr().out
    assert "96 x 96 cells" in out
    assert "matrix" in out


def test_an_unknown_benchmark_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "speed"]) == 2
    assert capsys.readouterr().err == "error: unknown benchmark 'speed'; there are paths\n"
