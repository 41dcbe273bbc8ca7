from pathlib import Path

import pytest

from marsupial.cli.main import main
from marsupial.formats.missionlog import read_log
from marsupial.model.mission import started


def test_the_demo_leaves_two_logs_and_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "--scenario", "lobby", "--budget", "0.05", "--out", str(out)]) == 0
    captured = capsys.readouterr()
    starts = [started(read_log(out / f"{name}.jsonl").events) for name in ("temporal", "heuristic")]
    assert starts[0].robots == starts[1].robots
    assert [start.strategy for start in starts] == ["temporal", "heuristic"]
    assert (out / "replay.html").read_text().count('class="log"') == 2
    assert "exploration time" in captured.out
    assert "100.0%" in captured.out
    assert f"wrote {out / 'replay.html'}" in captured.err
