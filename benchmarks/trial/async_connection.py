"""Cheap asynchronous HTTP connections: they assume well-formed answers."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator
from typing import Any, NamedTuple

from support.services.plain_client import HOST

_AGAIN_S = 0.02
_LONGEST_LINE = 1 << 24


class AsyncReply(NamedTuple):
    """Status and body."""

    status: int
    body: bytes


class AsyncConnection:
    """A connection that stays open."""

    def __init__(self, port: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._port = port
        self._reader = reader
        self.writer = writer

    @classmethod
    async def to(cls, port: int) -> AsyncConnection:
        """Connect."""
        return cls(port, *await asyncio.open_connection(HOST, port, limit=_LONGEST_LINE))

    async def post(self, path: str, body: bytes) -> AsyncReply:
        """Send JSON, and return the answer; retry if the server has closed the connection because it was idle."""
        try:
            return await self._post(path, body)
        except (ConnectionError, asyncio.IncompleteReadError):
            self._reader, self.writer = await asyncio.open_connection(HOST, self._port, limit=_LONGEST_LINE)
            return await self._post(path, body)

    async def _post(self, path: str, body: bytes) -> AsyncReply:
        head = f"POST {path} HTTP/1.1\r\nHost: {HOST}\r\nContent-Type: application/json\r\nContent-Length: {len(body)}"
        self.writer.write(head.encode() + b"\r\n\r\n" + body)
        told = (await self._reader.readuntil(b"\r\n\r\n")).lower()
        length = int(told.split(b"content-length:")[1].split(b"\r\n")[0])
        return AsyncReply(int(told[9:12]), await self._reader.readexactly(length))

    async def report(self, mission: str, reports: list[dict[str, Any]]) -> None:
        """Send reports to the mission at that path; retry while too many wait."""
        body = json.dumps({"reports": reports}).encode()
        while (answer := await self.post(f"{mission}/reports", body)).status == 429:
            await asyncio.sleep(_AGAIN_S)
        assert answer.status == 200, answer.body

    async def events(self, path: str) -> AsyncGenerator[tuple[bytes, bytes]]:
        """Yield type and data of the events of a stream; with HTTP/1.0 they come without chunks."""
        self.writer.write(f"GET {path} HTTP/1.0\r\nHost: {HOST}\r\n\r\n".encode())
        await self._reader.readuntil(b"\r\n\r\n")
        kind = b""
        while line := await self._reader.readline():
            if line.startswith(b"event: "):
                kind = line[7:-1]
            elif line.startswith(b"data: "):
                yield kind, line[6:-1]
