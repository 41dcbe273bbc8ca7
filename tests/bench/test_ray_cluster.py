"""Which Ray clusters are accepted; these tests need no cluster."""

import os
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest
from ray_nodes import needs_ray
from support.services.servers import free_port

from marsupial.bench.compare import ray_cluster
from marsupial.bench.compare.ray_cluster import Cluster, cluster_at, usable
from marsupial.bench.compare.ray_task import Requirements, WorkerMismatch, check_requirements
from marsupial.cli.main import main
from marsupial.errors import UsageError
from marsupial.versions import versions

SETTINGS = ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH", "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER",
            "RAY_USAGE_STATS_ENABLED")  # fmt: skip


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """Remove all settings of Ray and any token."""
    monkeypatch.setattr(os, "environ", os.environ.copy())
    for name in SETTINGS:
        os.environ.pop(name, None)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(ray_cluster, "version", lambda name: "2.60.0")
    monkeypatch.setattr(ray_cluster, "_reach", lambda cluster: None)
    monkeypatch.setattr(ray_cluster, "_test_connection", lambda cluster: None)
    return monkeypatch


@pytest.mark.parametrize(
    ("address", "cluster", "here"),
    [
        ("127.0.0.1:6379", Cluster("127.0.0.1:6379", "127.0.0.1", 6379), True),
        ("localhost:6379", Cluster("localhost:6379", "localhost", 6379), True),
        ("[::1]:6379", Cluster("[::1]:6379", "::1", 6379), True),
        ("192.0.2.7:6379", Cluster("192.0.2.7:6379", "192.0.2.7", 6379), False),
        ("ray://192.0.2.7", Cluster("ray://192.0.2.7:10001", "192.0.2.7", 10001), False),
        ("ray://127.0.0.1:7", Cluster("ray://127.0.0.1:7", "127.0.0.1", 7), True),
        ("auto", Cluster("auto"), False),
        ("local", Cluster("local"), True),
    ],
)
def test_an_address_shows_whether_others_can_reach_it(address: str, cluster: Cluster, here: bool) -> None:
    assert cluster_at(address) == cluster
    assert cluster.is_local == here


@pytest.mark.parametrize("address", ["", "host", "host:", "host:port", "host:99999", "http://host:1", "a@b:1", "h:1/x"])
def test_an_invalid_address_is_refused(address: str) -> None:
    with pytest.raises(UsageError, match="--ray: must be HOST:PORT, ray://HOST:PORT, auto or local"):
        cluster_at(address)


@pytest.mark.parametrize("address", ["192.0.2.7:6379", "ray://192.0.2.7:10001", "auto"])
def test_other_machines_are_only_talked_to_with_a_token(plain: pytest.MonkeyPatch, address: str) -> None:
    with pytest.raises(UsageError, match=r"--ray: .* set RAY_AUTH_MODE=token"):
        usable(cluster_at(address))
    plain.setitem(os.environ, "RAY_AUTH_TOKEN", "0" * 32)
    usable(cluster_at(address))
    assert os.environ["RAY_AUTH_MODE"] == "token"
    plain.setitem(os.environ, "RAY_AUTH_MODE", "disabled")
    with pytest.raises(UsageError, match="set RAY_AUTH_MODE=token"):
        usable(cluster_at(address))


def test_a_token_in_the_home_directory_is_used(plain: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / ".ray").mkdir()
    (tmp_path / ".ray" / "auth_token").write_text("0" * 32)
    usable(cluster_at("192.0.2.7:6379"))
    assert os.environ["RAY_AUTH_MODE"] == "token"


def test_an_own_cluster_has_its_own_token_and_is_local(plain: pytest.MonkeyPatch) -> None:
    usable(cluster_at("local"))
    assert os.environ["RAY_AUTH_MODE"] == "token"
    assert len(os.environ["RAY_AUTH_TOKEN"]) == 64
    assert os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] == "0"
    assert os.environ["RAY_USAGE_STATS_ENABLED"] == "0"


def test_without_ray_the_message_names_the_package(plain: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> str:
        raise PackageNotFoundError(name)

    plain.setattr(ray_cluster, "version", absent)
    with pytest.raises(
        UsageError, match=r"--ray: Ray is not installed; install it with: pip install 'marsupial\[ray\]'"
    ):
        usable(cluster_at("local"))
    plain.setattr(ray_cluster, "version", lambda name: "2.51.2")
    with pytest.raises(UsageError, match=r"--ray: Ray must be version 2.52 or newer, got 2.51.2"):
        usable(cluster_at("local"))


@needs_ray
@pytest.mark.parametrize("command", [["compare", "lobby"], ["reproduce", "wurm2010"]])
def test_an_address_where_nobody_answers_is_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    port = free_port()
    assert main([*command, "--ray", f"127.0.0.1:{port}", "--out", str(tmp_path / "x")]) == 2
    assert f"error: --ray: can't reach 127.0.0.1:{port}: Connection refused" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_a_cluster_has_its_own_number_of_workers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--ray", "local", "--workers", "2", "--out", str(tmp_path / "x")]
    assert main(["compare", "lobby", "--steps", "1", *arguments]) == 2
    assert "--workers can't be combined with --ray" in capsys.readouterr().err


def test_ray_is_not_imported_without_need() -> None:
    code = "import sys, marsupial.cli.main, marsupial.cli.work.comparing; sys.exit('ray' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_worker_of_another_version_or_without_token_authentication_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    requirements = Requirements(versions=versions(), token=False)
    check_requirements(requirements)
    with pytest.raises(WorkerMismatch, match=r"has numpy .* instead of 0\.1; install the same versions"):
        check_requirements(replace(requirements, versions=dict(versions()) | {"numpy": "0.1"}))
    monkeypatch.delenv("RAY_AUTH_MODE", raising=False)
    with pytest.raises(WorkerMismatch, match="accepts clients without a token"):
        check_requirements(replace(requirements, token=True))
    monkeypatch.setenv("RAY_AUTH_MODE", "token")
    check_requirements(replace(requirements, token=True))
