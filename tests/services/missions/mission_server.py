"""A service in a process of its own, for tests that talk to it, and kill it."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit


class Server:
    """`marsupial serve` on a data folder; `start` again after `kill` or `stop` listens at the same port."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.url = "http://127.0.0.1:0"
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def start(self) -> None:
        port = urlsplit(self.url).port
        command = [str(Path(sys.executable).parent / "marsupial"), "serve", "--data", str(self._folder)]
        self._process = subprocess.Popen(
            [*command, "--port", str(port), "--log-level", "warning"],
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ},
        )
        assert self._process.stderr is not None
        lines = []
        for line in self._process.stderr:
            lines.append(line)
            if line.startswith("marsupial serves at "):
                self.url = line.split()[-1]
                threading.Thread(target=self._process.stderr.read, daemon=True).start()
                return
        raise AssertionError("".join(lines))

    def kill(self) -> None:
        self._end(signal.SIGKILL)

    def stop(self) -> None:
        self._end(signal.SIGTERM)

    def _end(self, number: signal.Signals) -> None:
        assert self._process is not None
        self._process.send_signal(number)
        self._process.wait(10)
        assert self._process.stderr is not None
        self._process.stderr.close()

    def ask(self, method: str, path: str, body: object = None) -> tuple[int, str, Any]:
        """Return status, media type and what is answered, parsed where it is JSON."""
        connection = http.client.HTTPConnection(urlsplit(self.url).netloc, timeout=30)
        try:
            data = None if body is None else json.dumps(body)
            connection.request(method, path, data, {} if body is None else {"Content-Type": "application/json"})
            answer = connection.getresponse()
            kind, text = str(answer.headers.get_content_type()), answer.read().decode()
            return answer.status, kind, json.loads(text) if kind.endswith("json") else text
        finally:
            connection.close()
