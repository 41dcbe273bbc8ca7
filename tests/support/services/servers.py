"""Servers in separate processes, for tests and benchmarks: start, wait, kill, restart."""

import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Self

from support.services.plain_client import BROKEN, HOST, Reply, ask
from support.waiting import HANG_S, wait_until

START = [sys.executable, "-m", "marsupial.cli.main", "serve"]
PATIENT = {f"MARSUPIAL_{name}_S": str(HANG_S) for name in ["ANALYSIS", "BODY", "READ", "STEPS", "WAIT"]}
"""Environment with generous limits that no test examines; options override them."""
_POLL_S = 0.1


class NotStarted(Exception):
    """A server does not answer; the message has its log."""


class Server:
    """`marsupial serve` on a data folder; it runs within a `with` block, at the same address after each start.

    Parameters
    ----------
    options
        Of `marsupial serve`, besides folder and port.

    Attributes
    ----------
    environment
        Environment variables of the process.
    ready_s
        Seconds within which it has to be ready after its start.
    """

    environment: Mapping[str, str] = PATIENT
    program: Sequence[str] = START
    ready_s = HANG_S

    def __init__(self, data: Path, *options: str) -> None:
        self.data = data
        self.port = free_port()
        self._options = options
        self._log = data / "log.jsonl"
        self._told = 0
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.runs:
            self.stop()

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.port}"

    @property
    def log(self) -> str:
        """The log of all servers of this folder so far."""
        return self._log.read_text(errors="replace")

    @property
    def process(self) -> subprocess.Popen[bytes]:
        """The last started process."""
        assert self._process is not None
        return self._process

    @property
    def runs(self) -> bool:
        """Whether the last started process still runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start a process and wait until it answers requests. Raises NotStarted."""
        self.launch()
        wait_until(lambda: self._answers() or not self.runs, "the server")
        if not self._answers():
            raise NotStarted(self.log[-2000:])

    def _answers(self) -> bool:
        return b"serves at http://" in self._log.read_bytes()[self._told :]

    def launch(self, environment: Mapping[str, str] | None = None) -> None:
        """Start a process and return at once."""
        self.data.mkdir(parents=True, exist_ok=True)
        with self._log.open("ab") as log:
            self._told = log.tell()
            self._process = subprocess.Popen(
                [*self.program, "--port", str(self.port), "--data", str(self.data), *self._options],
                env={**os.environ, **self.environment, **(environment or {})},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def kill(self) -> None:
        """Kill it as by ``kill -9`` and wait for it."""
        self.process.kill()
        self.process.wait()

    def wait_ready(self) -> None:
        """Wait until it can plan, and write to its store. Raises NotStarted."""
        until = time.monotonic() + self.ready_s
        while time.monotonic() < until and self.runs:
            with suppress(*BROKEN):
                if self.ask("GET", "/readyz").status == 200:
                    return
            time.sleep(_POLL_S)
        raise NotStarted(self.log[-2000:])

    def stop(self) -> None:
        """Terminate it and wait for its end."""
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(HANG_S)

    def ask(self, method: str, path: str, body: object = None) -> Reply:
        """Send a request over a new connection."""
        return ask(self.port, method, path, body)


def free_port() -> int:
    """Return an unused port.

    It is below 32768, where the system's ports for outgoing connections begin, so it stays free while a server is down.
    """
    while True:
        port = 20_000 + secrets.randbelow(12_000)
        with socket.socket() as line, suppress(OSError):
            line.bind((HOST, port))
            return port
