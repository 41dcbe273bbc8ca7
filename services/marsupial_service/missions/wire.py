"""How the service and the process of a mission talk: pickled values over a Unix socket, each after its length."""

from __future__ import annotations

import asyncio
import pickle
import socket
import struct
from typing import Any

_LENGTH = struct.Struct("!Q")
TOKEN_BYTES = 32


def pack(value: object) -> bytes:
    """Return a value as it travels."""
    data = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
    return _LENGTH.pack(len(data)) + data


def receive(line: socket.socket) -> Any:
    """Return the next value. Raises EOFError if the other side is gone."""
    (length,) = _LENGTH.unpack(_exactly(line, _LENGTH.size))
    return pickle.loads(_exactly(line, length))


async def read(reader: asyncio.StreamReader) -> Any:
    """Return the next value. Raises EOFError if the other side is gone."""
    (length,) = _LENGTH.unpack(await reader.readexactly(_LENGTH.size))
    return pickle.loads(await reader.readexactly(length))


def _exactly(line: socket.socket, count: int) -> bytes:
    data = bytearray()
    while len(data) < count:
        chunk = line.recv(min(count - len(data), 1 << 20))
        if not chunk:
            raise EOFError("the service is gone")
        data += chunk
    return bytes(data)
