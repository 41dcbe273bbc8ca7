"""Ray nodes on this machine, whose processes a test may kill."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import psutil
import pytest
from support.services.servers import free_port
from support.waiting import HANG_S

needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed: pip install 'marsupial[ray]'")

STARTS = 8
"""How often nodes are started: Ray ends a node whose agent needs more than half a minute, as on a busy machine."""

PROGRAM = str(Path(__file__).with_name("ray_cluster_program.py"))


class Nodes:
    """A head without processors and `workers` nodes with one each, all on 127.0.0.1 and with a token."""

    def __init__(self, workers: int) -> None:
        for _ in range(STARTS):
            self._start(workers)
            if self.address:
                return
            text = (self.folder / "log").read_text(errors="replace")[-2000:]
            self.stop()
        pytest.fail(f"the cluster did not start: {text}")

    def _start(self, workers: int) -> None:
        """Start it; its address stays empty if it does not start."""
        self.folder = Path(tempfile.mkdtemp(prefix="ray-", dir="/tmp"))  # paths of sockets must be short
        self.env = settings_in(self.folder)
        client_port = free_port()
        with (self.folder / "log").open("wb") as log:
            self._program = subprocess.Popen([sys.executable, PROGRAM, str(workers), str(client_port)],
                                             env=with_settings(self.env), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                             stderr=log, start_new_session=True)  # fmt: skip
        self.address = self._program.stdout.readline().decode().strip()
        self.client = f"ray://127.0.0.1:{client_port}"

    def stop(self) -> None:
        running = self._family()
        self._program.communicate(timeout=HANG_S)
        for process in psutil.wait_procs(running, timeout=20)[1]:
            process.kill()
        assert psutil.wait_procs(running, HANG_S)[1] == []
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, *command: str, **env: str) -> subprocess.CompletedProcess[str]:
        """Run a Python program with the settings of these nodes; an empty text removes one."""
        return subprocess.run([sys.executable, *command], env=with_settings(self.env | env), capture_output=True,
                              text=True, check=False, timeout=HANG_S)  # fmt: skip

    def begin(self, *command: str) -> subprocess.Popen[bytes]:
        """Start a Python program with the settings of these nodes, in its own session."""
        return subprocess.Popen([sys.executable, *command], env=with_settings(self.env), stderr=subprocess.PIPE,
                                stdout=subprocess.DEVNULL, start_new_session=True)  # fmt: skip

    def missions(self) -> list[psutil.Process]:
        return [process for process in self._family() if _title(process).startswith("ray::attend")]

    def _family(self) -> list[psutil.Process]:
        try:
            return psutil.Process(self._program.pid).children(recursive=True)
        except psutil.NoSuchProcess:
            return []


def settings_in(folder: Path) -> dict[str, str]:
    """Return the environment of nodes that keep their files in a folder."""
    return {
        "RAY_AUTH_MODE": "token",
        "RAY_AUTH_TOKEN": "0123456789abcdef" * 4,
        "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
        "RAY_TMPDIR": str(folder),
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_health_check_period_ms": "1000",
        "RAY_health_check_failure_threshold": "3",
        "RAY_raylet_start_wait_time_s": "90",
        "RAY_worker_niceness": "0",  # 15 by default: on a busy machine workers would hardly run
        "PYTHONPATH": os.pathsep.join(sys.path),
    }


def with_settings(settings: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with `settings`; an empty text removes one."""
    env = os.environ | settings
    return {name: value for name, value in env.items() if value or name not in settings}


def interrupt(program: subprocess.Popen[bytes]) -> str:
    """Send Ctrl-C as a terminal does and return the program's stderr."""
    os.killpg(program.pid, signal.SIGINT)
    return program.communicate(timeout=HANG_S)[1].decode()


def _title(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""
