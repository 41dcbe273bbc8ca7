"""The container of docker/compose.yaml is built, started and healthy, with minimal privileges."""

import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

FILE = Path(__file__).resolve().parents[2] / "docker" / "compose.yaml"
WITHIN_S = 1800.0
"""Building takes minutes, as it compiles all code."""

Compose = Callable[..., subprocess.CompletedProcess[str]]


def docker(*words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "MARSUPIAL_PORT": "0"}
    return subprocess.run(
        ["docker", *words], capture_output=True, text=True, check=check, env=environment, timeout=WITHIN_S
    )


@pytest.fixture(scope="module")
def compose() -> Iterator[Compose]:
    """A function that runs `docker compose` commands while the service runs in its own project."""
    if shutil.which("docker") is None or docker("info", check=False).returncode != 0:
        pytest.skip("no docker daemon answers here")
    if docker("compose", "version", check=False).returncode != 0:
        pytest.skip("docker compose is not installed")

    def run(*words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        return docker("compose", "--project-name", "marsupial-test", "--file", str(FILE), *words, check=check)

    try:
        run("build")
        run("run", "--rm", "-T", "marsupial", "serve", "keys", "add", "ops", "--scope", "admin", "--data", "/data")
        run("up", "--detach", "--wait")
        yield run
    finally:
        run("down", "--volumes", check=False)


def test_the_service_is_healthy_asks_for_keys_and_is_seen_by_this_machine_only(compose: Compose) -> None:
    assert compose("exec", "-T", "marsupial", "health.py").returncode == 0
    ask = "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8080/v1/jobs')"
    assert "401" in compose("exec", "-T", "marsupial", "python", "-c", ask, check=False).stderr
    assert compose("port", "marsupial", "8080").stdout.startswith("127.0.0.1:")


def test_a_process_in_it_has_no_privileges_and_writes_data_and_tmp_only(compose: Compose) -> None:
    program = (
        "import json, os; status = dict(line.split(':\\t', 1) for line in open('/proc/self/status'));"
        "print(json.dumps({'uid': os.getuid(), 'rights': int(status['CapEff'], 16), 'fixed': int(status['NoNewPrivs']),"
        "'writable': [place for place in ('/', '/opt', '/data', '/tmp') if os.access(place, os.W_OK)]}))"
    )
    told = json.loads(compose("exec", "-T", "marsupial", "python", "-c", program).stdout)
    assert told == {"uid": 10001, "rights": 0, "fixed": 1, "writable": ["/data", "/tmp"]}
    tools = "import importlib.util as util; print([name for name in ('pip', 'setuptools') if util.find_spec(name)])"
    assert compose("exec", "-T", "marsupial", "python", "-c", tools).stdout == "[]\n"
