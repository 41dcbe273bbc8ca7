"""Servers in processes of their own, for tests and the trial: started, waited for, killed, started again."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from talk import HOST, Reply, ask

START = [sys.executable, "-m", "marsupial.cli.main", "serve"]
_START_S = 120.0
_END_S = 20.0
_POLL_S = 0.01


class NotStarted(Exception):
    """A server doesn't answer; its log says why."""


class Server:
    """`marsupial serve` on a data folder; within a block it runs, and listens at the same address after each start.

    Parameters
    ----------
    options
        Of `marsupial serve`, besides folder and port.
    port
        0 takes any free one.
    """

    def __init__(self, data: Path, *options: str, port: int = 0) -> None:
        self.data = data
        self.port = port
        self._options = options
        self._log = data / "log.jsonl"
        self._told = 0
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.runs:
            self.stop()

    @property
    def url(self) -> str:
        """Where it listens."""
        return f"http://{HOST}:{self.port}"

    @property
    def log(self) -> str:
        """What the servers of this folder have said so far."""
        return self._log.read_text(errors="replace")

    @property
    def process(self) -> subprocess.Popen[bytes]:
        """The process that was started last."""
        assert self._process is not None
        return self._process

    @property
    def runs(self) -> bool:
        """Whether the process that was started last still runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start a process and wait until it answers requests. Raises NotStarted."""
        self.launch()
        until = time.monotonic() + _START_S
        while time.monotonic() < until and self.runs:
            if match := re.search(rb"serves at http://\S+:(\d+)", self._log.read_bytes()[self._told :]):
                self.port = int(match[1])
                return
            time.sleep(_POLL_S)
        raise NotStarted(self.log[-2000:])

    def launch(self, environment: Mapping[str, str] | None = None) -> None:
        """Start a process; returns at once."""
        self.data.mkdir(parents=True, exist_ok=True)
        with self._log.open("ab") as log:
            self._told = log.tell()
            self._process = subprocess.Popen(
                [*START, "--port", str(self.port), "--data", str(self.data), *self._options],
                env={**os.environ, **(environment or {})},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def kill(self) -> None:
        """Kill it as by ``kill -9`` and wait for it."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        """Ask it to end and wait for it."""
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(_END_S)

    def ask(self, method: str, path: str, body: object = None) -> Reply:
        """Send a request over a connection of its own."""
        return ask(self.port, method, path, body)


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.socket() as line:
        line.bind((HOST, 0))
        port: int = line.getsockname()[1]
        return port
