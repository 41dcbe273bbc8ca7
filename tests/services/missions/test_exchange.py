"""No line of a mission's process is left open, whenever the service ends."""

import asyncio
import gc
import socket

from marsupial_service.missions.keeper import Exchange


def test_lines_that_nobody_has_taken_are_closed_when_the_service_ends() -> None:
    with socket.socket(socket.AF_UNIX) as unnamed, socket.socket(socket.AF_UNIX) as untaken:
        asyncio.run(_connected(unnamed, untaken))
        for line in (unnamed, untaken):
            line.settimeout(10)
            assert line.recv(1) == b""
    gc.collect()  # where a warning of an open socket would come to light


async def _connected(unnamed: socket.socket, untaken: socket.socket) -> None:
    exchange = Exchange()
    await exchange.start()
    try:
        with exchange.expected() as (token, line):
            unnamed.connect(exchange.address)
            unnamed.sendall(token[:-1])
            untaken.connect(exchange.address)
            untaken.sendall(token)
            await asyncio.wait([line])
    finally:
        await exchange.stop()
