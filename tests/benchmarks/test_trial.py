import json
import subprocess
import sys
from pathlib import Path

import pytest
from support.services.servers import Server

from benchmarks.trial.faulty_fleet import run
from benchmarks.trial.unreliable import UnreliableProxy

TRIAL = [sys.executable, "-m", "benchmarks", "trial"]
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_nothing_is_lost_where_a_database_that_servers_share_is_killed_too(tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    few = ["--store=postgresql", "--kills=8", f"--json={file}"]
    subprocess.run([*TRIAL, *few], cwd=ROOT, check=False, timeout=600, stdout=subprocess.DEVNULL)
    rows = {row["requirement"]: row for row in json.loads(file.read_text())}
    if any(row["judgement"] == "not run" for row in rows.values()):
        pytest.skip("no PostgreSQL server is installed (Debian: apt-get install postgresql)")
    counted = [row for row in rows.values() if row["goal"] == "0"]
    assert len(counted) >= 15
    assert [row for row in counted if row["judgement"] != "held"] == []
    assert rows["killed at random moments"]["values"]["database"] >= 1


@pytest.mark.slow
def test_nothing_is_lost_in_a_short_trial(tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    few = ["--kills=6", "--hostile=12", "--clients=4", "--posts=5", "--plans=4", "--half-open=50", "--fuzz-minutes=0"]
    few += ["--load-seconds=2", "--fair-jobs=1", "--stored=2000", "--pages=1", "--proxied=0"]
    subprocess.run([*TRIAL, *few, f"--json={file}"], cwd=ROOT, check=False, timeout=600, stdout=subprocess.DEVNULL)
    rows = {row["requirement"]: row for row in json.loads(file.read_text())}
    counted = [row for row in rows.values() if row["goal"] == "0"]
    assert len(counted) >= 15
    assert [row for row in counted if row["judgement"] != "held"] == []
    assert rows["killed at random moments"]["values"]["server"] >= 1


@pytest.mark.slow
def test_a_fleet_with_faults_behind_a_bad_proxy_ends_with_a_true_report(tmp_path: Path) -> None:
    with Server(tmp_path) as server, UnreliableProxy(server.port, 0.3, seed=1) as proxy:
        _, _, faults = run(f"http://127.0.0.1:{proxy.port}", 1, "lobby", carriers=2, killed=server)
    assert faults == []
    assert len(proxy.injected) > 3
