"""Send requests to a server and check its answers."""

import socket
from contextlib import suppress
from typing import Any

import httpx
import pytest
from support.services.plain_client import HOST
from support.services.proxies import Proxy
from support.services.servers import Server
from support.waiting import HANG_S

from marsupial.cli.main import main


def client(server: Server, **headers: str) -> httpx.Client:
    return httpx.Client(base_url=server.url, timeout=HANG_S, headers=headers, trust_env=False)


def opened(server: Server | Proxy, data: bytes = b"") -> socket.socket:
    """Open a connection and send some data."""
    line = socket.create_connection((HOST, server.port), timeout=HANG_S)
    line.sendall(data)
    return line


def rest(line: socket.socket) -> bytes:
    """Return all data until the other end closes the connection; a timeout fails the test."""
    found = b""
    with line, suppress(ConnectionResetError, BrokenPipeError):
        while chunk := line.recv(65536):
            found += chunk
    return found


def serve(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Run `marsupial serve` with these arguments in this process; return exit code, stdout and stderr."""
    code = main(["serve", *words])
    said = capsys.readouterr()
    return code, said.out, said.err


def problem(answer: httpx.Response, status: int, kind: str) -> dict[str, Any]:
    """Return a problem after checking its status and type."""
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    document: dict[str, Any] = answer.json()
    assert (answer.status_code, document["status"], document["type"].rpartition(":")[2]) == (status, status, kind)
    return document


def pointers(document: dict[str, Any]) -> list[str]:
    return [error["pointer"] for error in document["errors"]]
