"""A real server in a process of its own, for tests."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

START = [sys.executable, "-m", "marsupial.cli.main", "serve"]
CLOSED = [["#####", "#...#", "#####"]]


@dataclass
class Server:
    """A server that answers; `log` is what it has written to stderr so far."""

    process: subprocess.Popen[str]
    url: str
    log: list[str]


@contextmanager
def serving(folder: Path, *options: str) -> Iterator[Server]:
    """Run `marsupial serve` on a free port until the end of the block."""
    command = [*START, "--port", "0", "--data", str(folder), *options]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    log: list[str] = []
    try:
        for line in process.stderr:
            log.append(line)
            if match := re.search(r"serves at (http://\S+)", line):
                break
        else:
            raise AssertionError("".join(log))
        reader = threading.Thread(target=log.extend, args=(process.stderr,), daemon=True)
        reader.start()
        yield Server(process, match[1], log)
    finally:
        process.terminate()
        process.wait(20)
        process.stderr.close()


def client(server: Server, **headers: str) -> httpx.Client:
    return httpx.Client(base_url=server.url, timeout=60, headers=headers, trust_env=False)


def problem(answer: httpx.Response, status: int, kind: str) -> dict[str, Any]:
    """Return a problem after checking that it is the one expected."""
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    document: dict[str, Any] = answer.json()
    assert (answer.status_code, document["status"], document["type"].rpartition(":")[2]) == (status, status, kind)
    return document


def pointers(document: dict[str, Any]) -> list[str]:
    return [error["pointer"] for error in document["errors"]]


def events_of(lines: Iterator[str]) -> list[str]:
    """Return a stream's lines without comments."""
    return [line for line in lines if not line.startswith(":")]
